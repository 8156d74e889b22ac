#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "nadir/record/line_file.h"
#include "nadir/sim/run.h"

namespace nadir::record {

/// A NumPy array of records in one file (.npy, version 1.0), little-endian: whole numbers of a time and 64-bit numbers
/// behind it, by name: `numpy.load(path)["roll_deg"]`. It grows row by row; how many there are stands in it once it is
/// closed. Source of the format: NumPy Enhancement Proposal 1.
class NpyFile {
 public:
  static Result<NpyFile> create(const std::filesystem::path& path, const std::string& time_name,
                                const std::vector<std::string>& names);
  /// As many values as there are names.
  Result<void> add(std::int64_t time, std::span<const double> values);
  Result<void> close();

 private:
  std::string header() const;

  std::filesystem::path path_;
  FilePtr file_;
  std::string fields_;
  std::size_t columns_ = 0, rows_ = 0;
};

/// Writes telemetry/<vehicle>/state.csv or state.npy, as the run file says: time, pose in WGS-84 and in the scene, and
/// what a flown vehicle knows of itself, the channels of its kind last. Angles in degrees, all else SI, every digit
/// kept.
class TelemetrySink final : public sim::Sink {
 public:
  TelemetrySink(const sim::Run& run, std::filesystem::path folder) : run_(run), folder_(std::move(folder)) {}
  Result<void> on_state(const std::string& vehicle, const sim::VehicleState& state) override;
  Result<void> finish() override;

 private:
  const sim::Run& run_;
  std::filesystem::path folder_;
  std::map<std::string, LineFile> lines_;
  std::map<std::string, NpyFile> arrays_;
};

}  // namespace nadir::record
