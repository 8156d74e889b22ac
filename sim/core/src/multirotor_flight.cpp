#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "flight_air.h"
#include "flight_parts.h"
#include "nadir/sim/flown_multirotor.h"
#include "nadir/sim/ground_setup.h"
#include "pose_sources.h"
#include "scene_place.h"

namespace nadir::sim {
namespace {

using namespace geodesy;

/// Over its rotors: what turbulence is averaged over.
double span_m(const Multirotor& vehicle) {
  double reach_m = 0.25;
  for (const Rotor& rotor : vehicle.rotors) reach_m = std::max(reach_m, rotor.position_m.norm() + radius_m(rotor));
  return 2 * reach_m;
}

}  // namespace

Result<std::unique_ptr<PoseSource>> make_multirotor_flight(const RunFile& run, const std::string& name,
                                                           const VehicleSetup& setup, const MultirotorPlan& plan,
                                                           const render::Surface& ground) {
  const Multirotor vehicle = setup.multirotor_vehicle();
  const LocalFrame& scene = ground.frame();
  const Waypoint& start = plan.mission.start;
  const auto place = scene.ecef_from_enu() * Point<frame::Enu>{{start.east_m, start.north_m, start.height_m}};
  const auto environment = environment_of(run, scene, geodetic_from_ecef(place));
  if (!environment) return fail(environment);

  const double yaw = plan.mission.yaw_rad;
  const MakeFlight make = [&](const Scheme& scheme) -> Result<Flight> {
    auto parts = make_air(run, name, span_m(vehicle), ground);
    if (!parts) return fail(parts);
    auto air = AirAlongPath::start(std::move(*parts), place, {std::cos(yaw), std::sin(yaw), 0}, 0);
    if (!air) return fail(air);
    auto flown = fly_multirotor({.vehicle = vehicle,
                                 .environment = *environment,
                                 .scene = scene,
                                 .mission = plan.mission,
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
