#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/record/frame_record.h"
#include "nadir/record/image_files.h"
#include "nadir/render/frame.h"

namespace nadir::record {

/// Which pixels of an image are valid, row by row: a bit each where a row has both kinds, else none.
class PackedValidity {
 public:
  explicit PackedValidity(int width) : width_(static_cast<std::size_t>(width)) {}
  /// Whole rows, a byte a pixel, 1 or 0.
  void add(std::span<const std::uint8_t> validity);
  std::size_t rows() const { return rows_.size(); }
  /// A row as it was added.
  std::vector<std::uint8_t> row(std::size_t y) const;
  std::size_t held_bytes() const;

 private:
  struct Row {
    bool first = false;  // of its first pixel, of all where there are no bits
    std::vector<bool> pixels;
  };
  std::size_t width_;
  std::vector<Row> rows_;
};

/// A frame whose images are written while its bands come: the files, and the records, that the whole one would have.
/// Memory: an image's encoder, and the validity of rows that are valid in part. One thread at a time.
class BandedFrame {
 public:
  BandedFrame(const ImageFiles& images, std::filesystem::path folder, std::string vehicle, std::int64_t time_ns,
              bool masks)
      : images_(&images), folder_(std::move(folder)), vehicle_(std::move(vehicle)), time_ns_(time_ns), masks_(masks) {}

  /// The next band, from the top, of all layers.
  Result<void> add(const render::Frame& band);

  /// After the last one. `whole`: with the truth of all bands. Destroyed before, the frame leaves no file behind.
  Result<FrameRecords> finish(const render::Frame& whole);

 private:
  struct LayerFile {
    std::string name;  // in the dataset
    std::unique_ptr<ImageRows> rows;
    Checksum checksum;
    PackedValidity validity;
  };
  Result<void> begin(const render::FrameLayer& band);
  Result<void> write_mask(const std::string& name, const render::FrameLayer& whole, const PackedValidity& validity);

  const ImageFiles* images_;
  std::filesystem::path folder_;
  std::string vehicle_;
  std::int64_t time_ns_;
  bool masks_;
  std::vector<LayerFile> layers_;
};

}  // namespace nadir::record
