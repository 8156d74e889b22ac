#include "nadir/sim/monte_carlo.h"
#include "nadir/base/time.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>

#include "nadir/sim/run.h"

namespace nadir::sim {
namespace {

constexpr std::int64_t track_points = 200;

/// Keeps what an outcome says, and nothing that grows with the flight.
class OutcomeSink final : public Sink {
 public:
  OutcomeSink(const Run& run, std::vector<FlightOutcome>& outcomes) : run_(run), outcomes_(outcomes) {
    for (const PreparedVehicle& vehicle : run.vehicles())
      if (vehicle.source->motion_plan()) outcomes_.push_back({.seed = run.file().seed, .vehicle = vehicle.name});
  }

  Result<void> on_state(const std::string& vehicle, const VehicleState& state) override {
    if (!state.flight) return {};
    FlightOutcome& out = *std::find_if(outcomes_.begin(), outcomes_.end(),
                                       [&](const FlightOutcome& one) { return one.vehicle == vehicle; });
    const FlightData& data = *state.flight;
    const Eigen::Vector3d enu =
        (run_.ground().frame().enu_from_ecef() * geodesy::Point<geodesy::frame::Ecef>{state.ecef_from_body.origin}).xyz;
    const bool first = out.track_en_m.empty();
    out.end_s = seconds_from_ns(state.time_ns);
    out.end_east_m = enu.x(), out.end_north_m = enu.y(), out.end_up_m = enu.z();
    out.worst_off_path_m = std::max(out.worst_off_path_m, std::abs(data.off_path_right_m));
    out.worst_height_error_m = std::max(out.worst_height_error_m, std::abs(data.off_path_above_m));
    out.least_airspeed_mps = first ? data.airspeed_mps : std::min(out.least_airspeed_mps, data.airspeed_mps);
    out.greatest_airspeed_mps = std::max(out.greatest_airspeed_mps, data.airspeed_mps);
    out.greatest_roll_rad = std::max(out.greatest_roll_rad, std::abs(state.attitude.roll_rad));
    const auto wanted = static_cast<std::size_t>(state.time_ns * (track_points - 1) / run_.file().duration_ns);
    if (out.track_en_m.size() / 2 <= wanted) out.track_en_m.insert(out.track_en_m.end(), {enu.x(), enu.y()});
    return {};
  }

 private:
  const Run& run_;
  std::vector<FlightOutcome>& outcomes_;
};

Result<std::vector<FlightOutcome>> fly_one(Run& run) {
  std::vector<FlightOutcome> outcomes;
  OutcomeSink sink(run, outcomes);
  render::Renderer unused({.cache_bytes = 0, .threads = 1});
  const std::array<Sink*, 1> sinks = {&sink};
  const auto done = run.execute(unused, sinks, /*render_frames=*/false, /*pace=*/0);
  const RunEvent* ended = done ? done->ended() : nullptr;
  for (FlightOutcome& one : outcomes) {
    if (!done) one.fault = done.error().message;
    if (ended) one.fault = in_words(*ended);
  }
  return outcomes;
}

}  // namespace

Result<std::vector<FlightOutcome>> fly_many(const RunFile& run, int flights, int threads,
                                            const std::function<void(int)>& flown) {
  RunFile bare = run;
  for (auto& [name, vehicle] : bare.vehicles) {  // cameras cost and change nothing, but that surveys see with them
    const bool surveys = std::any_of(vehicle.mission.begin(), vehicle.mission.end(), [](const MissionItemSetup& item) {
      return std::holds_alternative<SurveySetup>(item.what);
    });
    if (!surveys) vehicle.sensors.clear();
  }
  auto first = Run::prepare(bare);
  if (!first) return fail(first);
  const RunFile planned = first->file();  // with the way of stepping resolved

  std::vector<Result<std::vector<FlightOutcome>>> results(static_cast<std::size_t>(flights));
  std::mutex telling;
  const auto fly = [&](int i) -> Result<std::vector<FlightOutcome>> {
    RunFile one = planned;
    one.seed = planned.seed + static_cast<std::uint64_t>(i);
    auto prepared = Run::prepare(one);
    if (!prepared) return fail(prepared);
    return fly_one(*prepared);
  };
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  arena.execute([&] {
    tbb::parallel_for(
        tbb::blocked_range<int>(0, flights, 1),
        [&](const tbb::blocked_range<int>& range) {
          for (int i = range.begin(); i < range.end(); ++i) {
            results[static_cast<std::size_t>(i)] = fly(i);
            if (!flown) continue;
            const std::lock_guard lock(telling);
            flown(1);
          }
        },
        tbb::simple_partitioner());
  });

  std::vector<FlightOutcome> all;
  for (auto& result : results) {
    if (!result) return fail(result);
    std::move(result->begin(), result->end(), std::back_inserter(all));
  }
  return all;
}

}  // namespace nadir::sim
