#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "nadir/record/dataset.h"
#include "nadir/record/line_file.h"
#include "nadir/sim/run.h"

namespace nadir::record {

/// Writes frames, masks and their truth into a dataset; truth planes too, where the run file asks for them.
class FrameSink final : public sim::Sink {
 public:
  /// `threads`: for truth planes; 0 for all the machine has.
  FrameSink(const sim::Run& run, Dataset& dataset, int threads) : run_(run), dataset_(dataset), threads_(threads) {}
  Result<void> on_frame(const sim::FrameEvent& event) override;
  Result<void> finish() override { return dataset_.finish(); }

 private:
  const sim::Run& run_;
  Dataset& dataset_;
  const int threads_;
};

/// Writes truth_rows/<vehicle>/<sensor>.txt: the 34 numbers a frame that the 2022 plugin's data set had: frame number;
/// pose, 4x4 row-major, whose upper left takes the world (x east, y north, z up at the scene origin) to the camera
/// turned by half a turn about its axis, and whose last column is the camera's position in the world; homography from
/// image to map pixels, 3x3 row-major; map pixels of the footprint's corners, x then y, in the order top left, top
/// right, bottom left, bottom right. Pixel centres at integers. A frame without a homography has no row.
class TruthRowSink final : public sim::Sink {
 public:
  explicit TruthRowSink(std::filesystem::path folder) : folder_(std::move(folder)) {}
  Result<void> on_frame(const sim::FrameEvent& event) override;
  Result<void> finish() override;

 private:
  struct Rows {
    LineFile file;
    std::int64_t frames = 0;
  };
  std::filesystem::path folder_;
  std::map<std::string, Rows> rows_;
};

}  // namespace nadir::record
