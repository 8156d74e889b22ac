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

constexpr std::size_t most_exposures = 400;  // looked at, of each sensor

class Preflight {
 public:
  Preflight(const Run& run, const PreparedVehicle& vehicle, const VehicleSetup& setup,
            std::vector<PreflightFinding>& out)
      : run_(run), vehicle_(vehicle), setup_(setup), out_(out), points_(planned_path(run.file(), vehicle)) {
    const auto& items = vehicle.planned()->setup_item;
    for (PlannedPoint& p : points_) p.item = items.empty() ? 0 : items[p.item];  // a survey is one of the run file's
    if (vehicle.multirotor_plan) {
      limits_ = multirotor_limits(run.file(), setup, run.ground(), ecef(points_.front()));
      return;
    }
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
    if (vehicle_.multirotor_plan) {
      if (auto ok = look_at_battery(check->seconds); !ok) return ok;
    } else {
      look_at_airspeeds();
      look_at_rough_air();
    }
    look_at_time(check->seconds);
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

  /// What steady flight along the path draws, and hover after it; changes of speed even out.
  Result<void> look_at_battery(double mission_s) {
    const Multirotor vehicle = setup_.multirotor_vehicle();
    if (!vehicle.battery) return {};
    const double duration_s = seconds_from_ns(run_.file().duration_ns);
    const double flown_s = lands() ? std::min(duration_s, mission_s) : duration_s;
    const double charge_as = vehicle.battery->capacity_ah * setup_.multirotor->charge_share * 3600;
    double drawn_as = 0, time_s = 0, empty_s = INFINITY, current_a = 0;
    std::size_t item = 0;  // where it is empty
    const auto draw = [&](double seconds, std::size_t at_item) {
      const double rest_s = std::min(seconds, flown_s - time_s);
      if (drawn_as + current_a * rest_s > charge_as && std::isinf(empty_s)) {
        empty_s = time_s + (charge_as - drawn_as) / current_a;
        item = at_item;
      }
      drawn_as += current_a * std::max(rest_s, 0.0);
      time_s += seconds;
    };
    constexpr std::size_t most_looked_at = 2000;
    const std::size_t stride = points_.size() / most_looked_at + 1;
    for (std::size_t i = 0; i < points_.size() && time_s < flown_s; ++i) {
      const PlannedPoint& p = points_[i];
      if (i % stride == 0) {
        const auto wind = wind_at(winds_, ecef(p), run_.ground());
        if (!wind) return fail(wind);
        const Eigen::Vector3d over_ground(p.kept->ground_speed_mps * std::cos(p.course_rad),
                                          p.kept->ground_speed_mps * std::sin(p.course_rad), -p.kept->climb_mps);
        const auto steady =
            multirotor_steady(run_.file(), setup_, p.kept->yaw_rad, over_ground - *wind, run_.ground(), ecef(p));
        if (steady) current_a = steady->output.supply_current_a;  // else it is told already that there is none
      }
      draw(p.kept->seconds, p.item);
    }
    if (time_s < flown_s) draw(flown_s - time_s, points_.back().item);
    if (empty_s < flown_s)
      note(item, true,
           fmt::format("the battery is empty after about {:.0f} s of the {:.0f} that are flown: fly less, or with a "
                       "larger one than {:g} A h",
                       empty_s, flown_s, charge_as / 3600));
    else if (drawn_as > 0.875 * charge_as)
      note(points_.back().item, false,
           fmt::format("the flight leaves about {:.0f} % of the battery's {:g} A h", 100 * (1 - drawn_as / charge_as),
                       charge_as / 3600));
    return {};
  }

  bool lands() const { return vehicle_.plan ? vehicle_.plan->ground.landing.has_value() : setup_.multirotor->land; }

  /// A run that ends before its landing, or goes on for long after a mission.
  void look_at_time(double mission_s) {
    if (setup_.mission.empty() || setup_.repeat_mission || !std::isfinite(mission_s)) return;
    const double duration_s = seconds_from_ns(run_.file().duration_ns);
    const std::size_t last = setup_.mission.size() - 1;
    constexpr double long_s = 60;
    if (lands() && mission_s > duration_s)
      note(last, false,
           fmt::format("the run ends after {:g} s, and landing takes until about {:.0f} s: raise duration_s",
                       duration_s, mission_s));
    const bool goes_on = std::holds_alternative<OrbitSetup>(setup_.mission.back().what) || lands();
    if (!goes_on && mission_s < 0.5 * duration_s && duration_s - mission_s > long_s)
      note(last, false,
           fmt::format("the mission is over after about {:.0f} s of the run's {:g} s: it {} on from there", mission_s,
                       duration_s, vehicle_.plan ? "circles" : "hovers"));
  }

  void look_at_surveys(double mission_s) {
    const double duration_s = seconds_from_ns(run_.file().duration_ns);
    for (const PlannedSurvey& survey : vehicle_.planned()->surveys) {
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
        time_s += p.kept ? p.kept->seconds : p.length_m / p.airspeed_mps.value_or(setup_.airspeed_mps);
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
    const Eigen::Quaterniond yaw(Eigen::AngleAxisd(p.kept ? p.kept->yaw_rad : p.course_rad, Eigen::Vector3d::UnitZ()));
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
    if (!vehicle.planned()) continue;
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
