#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "nadir/record/overview.h"
#include "nadir/record/report.h"
#include "nadir/sim/run.h"

namespace nadir::record {

/// When a camera saw what no map covers, or sky: from the first such exposure to the last in a row.
struct Excursion {
  std::int64_t from_ns = 0, to_ns = 0;
  std::int64_t exposures = 0;
};

/// Collects what a person wants to see of a run, and makes report.html of it, with its pictures beside.
class FlightReport final : public sim::Sink {
 public:
  explicit FlightReport(const sim::Run& run);

  Result<void> on_state(const std::string& vehicle, const sim::VehicleState& state) override;
  Result<void> on_frame(const sim::FrameEvent& event) override;

  /// What was flown and seen so far; `summary` is of Run::execute. Pictures go to `folder`/pictures.
  /// `frames`: the frames were rendered; else it is a rehearsal.
  Result<void> write(render::Renderer& renderer, const std::filesystem::path& folder, const sim::RunSummary& summary,
                     bool frames) const;

  /// Largest distances from the path that was to be flown, metres; 0 where nothing is flown. The first `settle_s` do
  /// not count: a vehicle starts with its nose along the path, and the wind turns it first.
  double worst_cross_track_m() const;
  double worst_height_error_m() const;
  bool flown() const;       // by a model; recorded poses have no path to be off
  double settle_s() const;  // 5, and 0 for flights of less than 10 s
  std::vector<double> frame_ms() const;
  double mean_valid_fraction() const;
  /// Of one sensor, by "vehicle/sensor".
  std::map<std::string, std::vector<Excursion>> excursions() const;

 private:
  struct VehicleLog {
    std::string name;
    Series height, commanded_height, yaw, pitch, roll, airspeed, ground_speed, cross_track, height_error, throttle;
    bool flown = false;
  };
  struct SensorLog {
    std::string vehicle, name;
    Overview overview;
    Series cost, valid, gsd;
    std::vector<Excursion> excursions;
    bool outside = false;  // at the last exposure
  };
  std::vector<ReportItem> flight_charts(const VehicleLog& log) const;
  Section maps_section() const;

  const sim::Run& run_;
  std::vector<VehicleLog> vehicles_;
  std::vector<SensorLog> sensors_;
};

}  // namespace nadir::record
