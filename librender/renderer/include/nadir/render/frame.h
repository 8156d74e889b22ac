#pragma once

#include <cassert>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "nadir/render/explanation.h"
#include "nadir/render/frame_counters.h"
#include "nadir/render/frame_memory.h"
#include "nadir/render/truth.h"
#include "nadir/tile/sample_type.h"

namespace nadir::render {

/// One layer of a frame: an image and which of its pixels are real.
struct FrameLayer {
  std::string name;
  int width = 0, height = 0, bands = 0;
  tile::SampleType type = tile::SampleType::UInt8;
  FrameBuffer<std::byte> samples;      // height * width * bands, bands interleaved
  FrameBuffer<std::uint8_t> validity;  // height * width, 1 valid, 0 not
  Truth truth;
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
  /// Empty but where RenderOptions::explain asked for it.
  const Explanation& explanation() const { return explanation_; }

 private:
  friend class Renderer;
  std::vector<FrameLayer> layers_;
  FrameCounters counters_;
  Explanation explanation_;
};

}  // namespace nadir::render
