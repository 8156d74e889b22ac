#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "flight_air.h"
#include "flight_parts.h"
#include "nadir/sim/flown_multirotor.h"
#include "nadir/sim/ground_setup.h"
#include "nadir/sim/multirotor_ground.h"
#include "pose_sources.h"
#include "scene_place.h"

namespace nadir::sim {
namespace {

using namespace geodesy;

constexpr double on_ground_m = 0.01;  // a start that is no higher stands

/// Over its rotors: what turbulence is averaged over.
double span_m(const Multirotor& vehicle) {
  double reach_m = 0.25;
  for (const Rotor& rotor : vehicle.rotors) reach_m = std::max(reach_m, rotor.position_m.norm() + radius_m(rotor));
  return 2 * reach_m;
}

Result<MultirotorMission> mission_of(const VehicleSetup& setup, const render::Surface& ground, double legs_m) {
  const MultirotorSetup& wanted = *setup.multirotor;
  MultirotorMission mission;
  const auto start = place_in_scene(setup.start.place, setup.start.height, ground);
  if (!start) return fail(start);
  mission.start = {start->north_east_m.x(), start->north_east_m.y(), start->height_m};
  mission.ground_height_m = ground.up_m();
  const double above_m = start->height_m - ground.up_m();
  if (above_m < -on_ground_m)
    return fail(Error::Kind::Malformed,
                fmt::format("start: expected a height on the ground or above it, found {:.1f} m under it", -above_m));
  mission.from_ground = above_m <= on_ground_m;
  if (mission.from_ground) mission.start.height_m = ground.up_m() + legs_m;
  mission.yaw_rad = to_radians(setup.yaw_deg);
  mission.take_off_height_m = wanted.take_off_height_m;
  for (std::size_t i = 0; i < wanted.mission.size(); ++i) {
    const MultirotorWaypointSetup& w = wanted.mission[i];
    const auto place = place_in_scene(w.place, w.height, ground);
    if (!place) return fail(place);
    if (place->height_m <= ground.up_m())
      return fail(Error::Kind::Malformed,
                  fmt::format("mission: waypoint {}: expected a height above the ground, found {:.1f} m over it", i + 1,
                              place->height_m - ground.up_m()));
    PositionWaypoint point{.at = {place->north_east_m.x(), place->north_east_m.y(), place->height_m},
                           .hold_s = w.hold_s,
                           .speed_mps = w.speed_mps,
                           .yaw_rad = {}};
    if (w.yaw_deg) point.yaw_rad = to_radians(*w.yaw_deg);
    mission.waypoints.push_back(point);
  }
  mission.repeat = setup.repeat_mission;
  mission.face_along = wanted.face_along;
  mission.land = wanted.land;
  mission.landing_mps = wanted.landing_mps;
  mission.limits = {.speed_mps = wanted.speed_mps,
                    .climb_mps = wanted.climb_mps,
                    .descent_mps = wanted.descent_mps,
                    .acceleration_mps2 = wanted.acceleration_mps2};
  return mission;
}

}  // namespace

Result<std::unique_ptr<PoseSource>> make_multirotor_flight(const RunFile& run, const std::string& name,
                                                           const VehicleSetup& setup, const render::Surface& ground) {
  const Multirotor vehicle = setup.multirotor_vehicle();
  const auto mission = mission_of(setup, ground, standing_height_m(gear_of(vehicle)));
  if (!mission) return fail(mission);
  const LocalFrame& scene = ground.frame();
  const Waypoint& start = mission->start;
  const auto place = scene.ecef_from_enu() * Point<frame::Enu>{{start.east_m, start.north_m, start.height_m}};
  const auto environment = environment_of(run, scene, geodetic_from_ecef(place));
  if (!environment) return fail(environment);

  const double yaw = mission->yaw_rad;
  const MakeFlight make = [&](const Scheme& scheme) -> Result<Flight> {
    auto parts = make_air(run, name, span_m(vehicle), ground);
    if (!parts) return fail(parts);
    auto air = AirAlongPath::start(std::move(*parts), place, {std::cos(yaw), std::sin(yaw), 0}, 0);
    if (!air) return fail(air);
    auto flown = fly_multirotor({.vehicle = vehicle,
                                 .environment = *environment,
                                 .scene = scene,
                                 .mission = *mission,
                                 .wind_ned_mps = air->air().end().velocity_ned_mps,
                                 .charge_share = setup.multirotor->charge_share,
                                 .ground = ground_of(ground),
                                 .tolerance_m = setup.trajectory_tolerance_m,
                                 .scheme = scheme});
    if (!flown) return fail(flown);
    return Flight(*environment, std::move(*air), std::move(*flown));
  };
  return planned_flight(make, setup, run.duration_ns);
}

}  // namespace nadir::sim
