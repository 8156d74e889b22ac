#include "nadir/sim/preflight.h"
#include "nadir/base/time.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "flight_air.h"
#include "nadir/sim/plan_check.h"
#include "nadir/sim/rehearsal.h"
#include "scene_place.h"
#include "vehicle_kind.h"

namespace nadir::sim {
namespace {

constexpr double step_m = 10;
constexpr std::size_t most_exposures = 400;  // looked at, of each sensor

class Preflight {
 public:
  Preflight(const Run& run, const PreparedVehicle& vehicle, const VehicleSetup& setup,
            std::vector<PreflightFinding>& out)
      : run_(run), vehicle_(vehicle), setup_(setup), out_(out), points_(planned_path(*vehicle.plan, step_m)) {
    const auto& items = vehicle.plan->setup_item;
    for (PlannedPoint& p : points_) p.item = items.empty() ? 0 : items[p.item];  // a survey is one of the run file's
    limits_ = flight_limits(setup);
    const FixedWingGroundSetup& ground = vehicle.plan->ground;  // whose ways to the ground and from it are no fault
    constexpr double lower = 0.9;
    if (ground.takeoff) limits_.near_ground_m = std::min(limits_.near_ground_m, lower * ground.takeoff->clear_m);
    if (ground.landing)
      limits_.near_ground_m = std::min(limits_.near_ground_m, lower * ground.landing->approach_height_m);
  }

  Result<void> look() {
    auto winds = make_winds(run_.file());
    if (!winds) return fail(winds);
    winds_ = std::move(*winds);
    const auto check = check_plan(points_, limits_, [this](const PlannedPoint& p) -> Result<PlanSurroundings> {
      const auto place = ecef(p);
      const auto wind = wind_at(winds_, place, run_.ground());
      if (!wind) return fail(wind);
      return PlanSurroundings{wind->head<2>(), height_above_ground_m(run_.ground(), place)};
    });
    if (!check) return fail(check);
    for (const PlanFinding& f : check->findings) note(f.item, f.impossible, f.message);
    look_at_airspeeds();
    look_at_rough_air();
    look_at_surveys(check->seconds);
    return look_at_cameras();
  }

 private:
  /// `item`: of the vehicle's mission; the vehicle itself where it has none.
  void note(std::size_t item, bool impossible, const std::string& message) {
    const RunFile& file = run_.file();
    out_.push_back({impossible, setup_.mission.empty()
                                    ? fmt::format("{}: 'vehicles.{}': {}", file.file.string(), vehicle_.name, message)
                                    : mission_message(file, setup_.mission[item], message)});
  }

  geodesy::Point<geodesy::frame::Ecef> ecef(const PlannedPoint& p) const {
    return ecef_from_scene({{p.north_m, p.east_m}, p.height_m}, run_.ground());
  }

  /// A vehicle flies steadily between two airspeeds: those farthest out tell of all.
  void look_at_airspeeds() {
    std::map<std::size_t, std::pair<const PlannedPoint*, const PlannedPoint*>> extremes;
    for (const PlannedPoint& p : points_) {
      if (!p.airspeed_mps) continue;
      auto& [slowest, fastest] = extremes[p.item];
      if (!slowest || *p.airspeed_mps < *slowest->airspeed_mps) slowest = &p;
      if (!fastest || *p.airspeed_mps > *fastest->airspeed_mps) fastest = &p;
    }
    for (const auto& [item, pair] : extremes)
      for (const PlannedPoint* p : {pair.first, pair.second}) {
        if (p == pair.second && *pair.first->airspeed_mps == *pair.second->airspeed_mps) continue;
        const auto steady = level_pitch_rad(run_.file(), setup_, *p->airspeed_mps, ecef(*p));
        if (!steady) note(item, true, steady.error().message);
      }
  }

  /// Gusts and turbulence come on top of the wind; three deviations of it are met now and then.
  void look_at_rough_air() {
    const AirSetup& air = run_.file().air;
    double gust_mps = 0;
    for (const Gust& gust : air.gusts) gust_mps = std::max(gust_mps, std::abs(gust.speed_mps));
    if (air.turbulence) gust_mps += 3 * 0.1 * air.turbulence->wind_at_20ft_mps();
    if (gust_mps > 0.5 * setup_.airspeed_mps)
      note(0, false,
           fmt::format("gusts of {:.1f} m/s are more than half of the airspeed of {:g} m/s: it may stall", gust_mps,
                       setup_.airspeed_mps));
  }

  void look_at_surveys(double mission_s) {
    const double duration_s = seconds_from_ns(run_.file().duration_ns);
    for (const PlannedSurvey& survey : vehicle_.plan->surveys) {
      const SensorSetup& sensor = run_.sensor(vehicle_.name, survey.sensor).setup;
      if (sensor.rate.hz() < survey.rate_hz / 1.01)
        note(survey.item, false,
             fmt::format("its forward overlap takes {:.3f} frames a second, and {} makes {:g}: raise its rate_hz, "
                         "or write 'survey' there",
                         survey.rate_hz, survey.sensor, sensor.rate.hz()));
      if (std::isfinite(mission_s) && mission_s > duration_s)
        note(survey.item, false,
             fmt::format("the run ends after {:g} s, and its mission takes about {:.0f} s: the survey may not be "
                         "finished",
                         duration_s, mission_s));
    }
  }

  Result<void> look_at_cameras() {
    for (const PreparedSensor& sensor : run_.sensors()) {
      if (sensor.vehicle != vehicle_.name) continue;
      const double duration_s = seconds_from_ns(run_.file().duration_ns);
      std::map<std::size_t, std::pair<std::size_t, std::size_t>> off;  // by item: off the map, and looked at
      double time_s = 0;
      const std::size_t stride = points_.size() / most_exposures + 1;
      for (std::size_t i = 0; i < points_.size() && time_s <= duration_s; ++i) {
        const PlannedPoint& p = points_[i];
        time_s += p.length_m / p.airspeed_mps.value_or(setup_.airspeed_mps);
        if (i % stride != 0 || p.low) continue;
        auto& [away, looked_at] = off[p.item];
        const auto truth =
            render::geometric_truth(exact_chain(level_flight(p), sensor), sensor.scene.layers().front().source->map());
        ++looked_at;
        away += !on_map(truth);
      }
      for (const auto& [item, counts] : off)
        if (counts.first > 0)
          note(item, false,
               fmt::format(
                   "{} leaves the map in about {:.0f} % of the exposures on the way: `nadir fly --dry-run` draws "
                   "where",
                   sensor.name,
                   std::ceil(100.0 * static_cast<double>(counts.first) / static_cast<double>(counts.second))));
    }
    return {};
  }

  /// Nose along the path, wings level.
  VehicleState level_flight(const PlannedPoint& p) const {
    const auto place = ecef(p);
    const auto ned = geodesy::ecef_from_ned(geodesy::geodetic_from_ecef(place));
    const Eigen::Quaterniond yaw(Eigen::AngleAxisd(p.course_rad, Eigen::Vector3d::UnitZ()));
    return vehicle_state(0, {ned.rotation * yaw, place.xyz});
  }

  const Run& run_;
  const PreparedVehicle& vehicle_;
  const VehicleSetup& setup_;
  std::vector<PreflightFinding>& out_;
  std::vector<PlannedPoint> points_;
  FlightLimits limits_;
  std::vector<std::unique_ptr<WindSource>> winds_;
};

}  // namespace

Result<std::vector<PreflightFinding>> preflight(const Run& run) {
  std::vector<PreflightFinding> findings;
  for (const PreparedVehicle& vehicle : run.vehicles()) {
    if (!vehicle.plan) continue;
    for (const auto& [name, setup] : run.file().vehicles) {
      if (name != vehicle.name) continue;
      if (auto ok = Preflight(run, vehicle, setup, findings).look(); !ok) return fail(ok);
    }
  }
  return findings;
}

std::string preflight_text(const std::vector<PreflightFinding>& findings, bool impossible) {
  std::string text;
  for (const PreflightFinding& f : findings)
    if (f.impossible == impossible) text += (text.empty() ? "" : "\n") + f.message;
  return text;
}

}  // namespace nadir::sim
