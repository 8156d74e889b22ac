#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "nadir/render/frame.h"

namespace nadir::record {

/// What a dataset knows of a frame beside its truth.
struct FrameFile {
  std::string file;          // path in the dataset
  std::string mask_file;     // empty where every pixel is valid, or invalid ones were filled
  std::string truth_planes;  // path in the dataset; empty where they were not asked for
  std::string vehicle, sensor;
  std::int64_t time_ns = 0;
};

/// What a dataset's lists say of a frame, all layers of it.
struct FrameRecords {
  std::string lines;                  // of frames.jsonl
  std::vector<std::string> features;  // of footprints.geojson
};

/// Of a frame's layer: XXH3-64 of its samples, in rows from the top, little-endian, then of its validity bytes.
class Checksum {
 public:
  Checksum();
  ~Checksum();
  Checksum(Checksum&&) noexcept;
  Checksum& operator=(Checksum&&) noexcept;

  void add(std::span<const std::byte> bytes);
  /// "xxh3:<16 hex digits>"
  std::string text() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Of all of a layer.
std::string checksum(const render::FrameLayer& layer);

/// One line of frames.jsonl, without the line feed: all of a frame's truth. `frames.schema.json` describes it.
std::string frame_record(const FrameFile& file, const render::FrameLayer& layer);
/// Likewise, of a layer whose pixels are gone.
std::string frame_record(const FrameFile& file, const render::FrameLayer& layer, const std::string& checksum);

/// A frame's Feature of footprints.geojson, on one line: what it sees on the ground, and whence.
/// `footprints.schema.json` describes it.
std::string footprint_feature(const FrameFile& file, const render::FrameLayer& layer);

/// The line of a frame that was not made, and why.
std::string rejected_frame_record(const FrameFile& file, const std::string& reason);

}  // namespace nadir::record
