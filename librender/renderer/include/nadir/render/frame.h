#pragma once

#include <cassert>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "nadir/render/truth.h"
#include "nadir/tile/sample_type.h"

namespace nadir::render {

/// One layer of a frame: an image and which of its pixels are real.
struct FrameLayer {
  std::string name;
  int width = 0, height = 0, bands = 0;
  tile::SampleType type = tile::SampleType::UInt8;
  std::vector<std::byte> samples;      // height * width * bands, bands interleaved
  std::vector<std::uint8_t> validity;  // height * width, 1 valid, 0 not
  Truth truth;
};

/// What making a frame took.
struct FrameCounters {
  std::int64_t exact_points = 0;       // evaluations of the exact chain
  std::int64_t projection_points = 0;  // of them, through the projection library, and for truth and culling
  std::int64_t cells = 0, cells_loaded = 0;
  std::int64_t windows_read = 0, samples_read = 0;  // from maps
  std::int64_t samples = 0;                         // bilinear or nearest samples taken
  std::int64_t passes = 0;
};

/// What was done for a frame, what was left out, and why: text for people.
struct Explanation {
  std::vector<std::string> done, left_out;
};

class Frame {
 public:
  const std::vector<FrameLayer>& layers() const { return layers_; }

  /// The layer of that name; the first one for an empty name. It must be there.
  const FrameLayer& layer(std::string_view name = {}) const {
    for (const FrameLayer& l : layers_)
      if (name.empty() || l.name == name) return l;
    assert(!"no layer of that name");
    return layers_.front();
  }

  /// Samples of a layer: height * width * bands. T must be its type.
  template <class T>
  std::span<const T> pixels(std::string_view name = {}) const {
    const FrameLayer& l = layer(name);
    assert(l.type == tile::sample_type_of<T>);
    return {reinterpret_cast<const T*>(l.samples.data()), l.samples.size() / sizeof(T)};
  }
  const Truth& truth(std::string_view name = {}) const { return layer(name).truth; }
  const FrameCounters& counters() const { return counters_; }
  const Explanation& explanation() const { return explanation_; }

 private:
  friend class Renderer;
  std::vector<FrameLayer> layers_;
  FrameCounters counters_;
  Explanation explanation_;
};

}  // namespace nadir::render
