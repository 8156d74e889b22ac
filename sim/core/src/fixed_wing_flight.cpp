#include <cmath>

#include "climb_out.h"
#include "flight_air.h"
#include "flight_parts.h"
#include "pose_sources.h"

namespace nadir::sim {
namespace {

using namespace geodesy;

/// A flight about to begin, with its air.
struct Beginning {
  FixedWingFlight flight;
  AirAlongPath air;
};

Result<Beginning> beginning(const RunFile& run, const VehicleSetup& setup, const Waypoint& begin,
                            const FixedWingGroundSetup& ground_setup, const Mission& mission, AirParts parts,
                            const LocalFrame& scene) {
  const Geodetic place =
      geodetic_from_ecef(scene.ecef_from_enu() * Point<frame::Enu>{{begin.east_m, begin.north_m, begin.height_m}});
  const auto environment = environment_of(run, scene, place);
  if (!environment) return fail(environment);
  const double yaw_rad = to_radians(setup.yaw_deg);
  auto air = AirAlongPath::start(std::move(parts), ecef_from_geodetic(place), {std::cos(yaw_rad), std::sin(yaw_rad), 0},
                                 setup.airspeed_mps);
  if (!air) return fail(air);
  const Eigen::Vector3d wind_ned_mps = air->air().end().velocity_ned_mps;
  return Beginning{{.vehicle = setup.fixed_wing(),
                    .environment = *environment,
                    .scene = scene,
                    .start = place,
                    .yaw_rad = yaw_rad,
                    .airspeed_mps = setup.airspeed_mps,
                    .wind_ned_mps = wind_ned_mps,
                    .mission = mission,
                    .change_gains = [autopilot = setup.autopilot](FlightGains& gains) { autopilot.apply(gains); },
                    .fly_unstable = setup.autopilot.fly_unstable,
                    .ground = ground_setup,
                    .tolerance_m = setup.trajectory_tolerance_m},
                   std::move(*air)};
}

}  // namespace

Result<std::unique_ptr<PoseSource>> make_flight(const RunFile& run, const std::string& name, const VehicleSetup& setup,
                                                const FlightPlan& plan, const render::Surface& ground) {
  const MakeFlight make = [&](const Scheme& scheme) -> Result<Flight> {
    auto parts = make_air(run, name, setup.fixed_wing().span_m, ground);
    if (!parts) return fail(parts);
    auto begins = beginning(run, setup, plan.begin, plan.ground, plan.mission, std::move(*parts), ground.frame());
    if (!begins) return fail(begins);
    begins->flight.scheme = scheme;
    const Environment environment = begins->flight.environment;
    auto flown = fly_fixed_wing(std::move(begins->flight));
    if (!flown) return fail(flown);
    return Flight(environment, std::move(begins->air), std::move(*flown));
  };
  return planned_flight(make, setup, run.duration_ns);
}

Result<Waypoint> climb_out(const RunFile& run, const std::string& name, const VehicleSetup& setup,
                           const Waypoint& begin, const FixedWingGroundSetup& ground_setup,
                           const render::Surface& ground) {
  auto parts = make_air(run, name, setup.fixed_wing().span_m, ground);
  if (!parts) return fail(parts);
  parts->gusts.clear();
  parts->turbulence.reset();
  const MissionItem ahead = Waypoint{begin.north_m + 1000, begin.east_m, begin.height_m};  // is not looked at
  const auto mission = Mission::create(begin, {&ahead, 1}, setup.turn_radius_m);
  if (!mission) return fail(mission);
  auto begins = beginning(run, setup, begin, ground_setup, *mission, std::move(*parts), ground.frame());
  if (!begins) return fail(begins);
  return climb_out_end(std::move(begins->flight), std::move(begins->air));
}

}  // namespace nadir::sim
