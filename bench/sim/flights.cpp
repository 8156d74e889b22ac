#include "flights.h"

#include <algorithm>

#include "nadir/sim/flown_multirotor.h"
#include "nadir/sim/vehicle_file.h"

namespace nadir::bench {
namespace {
using namespace sim;

const geodesy::Geodetic place = geodesy::Geodetic::degrees(38.1, -0.76, 3000);
const Eigen::Vector3d wind_ned_mps(3, -6, 0);
constexpr double airspeed_mps = 25;

std::unique_ptr<FlownVehicle> vehicle(const Scheme& scheme, const Eigen::Vector3d& carried_ned_mps, Mission mission) {
  return fly_fixed_wing({.vehicle = fixed_wing_model("aerosonde").value(),
                         .environment = Environment::wgs84(),
                         .scene = geodesy::LocalFrame(place),
                         .start = place,
                         .airspeed_mps = airspeed_mps,
                         .wind_ned_mps = carried_ned_mps,
                         .mission = std::move(mission),
                         .scheme = scheme})
      .value();
}

AirAlongPath start(AirParts parts) {
  parts.height_above_ground_m = [](const geodesy::Point<geodesy::frame::Ecef>& p) {
    return geodesy::geodetic_from_ecef(p).height_m;
  };
  return AirAlongPath::start(std::move(parts), geodesy::ecef_from_geodetic(place), {1, 0, 0}, airspeed_mps).value();
}
}  // namespace

AirAlongPath air_of_the_square(bool turbulent) {
  AirParts parts;
  parts.sources.push_back(std::make_unique<SteadyWind>(wind_ned_mps, Shear{}));
  if (turbulent)
    parts.turbulence = Turbulence(wind_at_20ft_mps(TurbulenceIntensity::Light),
                                  fixed_wing_model("aerosonde").value().span_m, RandomStream(5, "turbulence/plane"));
  return start(std::move(parts));
}

PathPoint start_of_the_square() {
  const auto at = geodesy::ecef_from_geodetic(place);
  return {at, {Environment::wgs84().at(at).ecef_from_ned * (Eigen::Vector3d(airspeed_mps, 0, 0) + wind_ned_mps)}};
}

std::unique_ptr<FlownVehicle> vehicle_of_the_square(const Scheme& scheme) {
  const MissionItem corners[] = {Waypoint{1000, 0, 0}, Waypoint{1000, 1000, 20}, Waypoint{0, 1000, 20},
                                 Waypoint{0, 5, 0}};
  return vehicle(scheme, wind_ned_mps, Mission::create({0, 0, 0}, corners, 150, AfterMission::Repeat).value());
}

Flight aerosonde_in_a_circle() {
  const MissionItem only = Waypoint{300, 0, 0};  // whose mission ends in a circle
  return {Environment::wgs84(), start({}),
          vehicle({.method = Scheme::Method::DormandPrince}, Eigen::Vector3d::Zero(),
                  Mission::create({0, 0, 0}, {&only, 1}, 150, AfterMission::Circle).value())};
}

Flight multirotor_around_a_square(const Scheme& scheme, bool motors_and_battery) {
  const geodesy::LocalFrame scene(place);
  Multirotor copter = multirotor_model("multirotor").value();
  if (motors_and_battery) {
    for (Rotor& rotor : copter.rotors)
      std::get<ElectricDrive>(rotor.drive).dynamics = {.rotor_inertia_kgm2 = 2e-4, .inductance_h = 8e-6};
    copter.battery = lithium_polymer(6, 10, 0.02);
  }
  MultirotorMission mission{.start = {0, 0, 50}, .repeat = true};
  for (const Waypoint& corner : {Waypoint{60, 0, 50}, Waypoint{60, 60, 55}, Waypoint{0, 60, 55}, Waypoint{0, 0, 50}})
    mission.waypoints.push_back({.at = corner});
  return {Environment::wgs84(), air_of_the_square(false),
          fly_multirotor({.vehicle = std::move(copter),
                          .environment = Environment::wgs84(),
                          .scene = scene,
                          .mission = std::move(mission),
                          .wind_ned_mps = wind_ned_mps,
                          .ground = std::make_shared<PlaneGround>(scene, 0),
                          .scheme = scheme})
              .value()};
}

Flight aerosonde_around_a_square(const Scheme& scheme, bool turbulent) {
  return {Environment::wgs84(), air_of_the_square(turbulent), vehicle_of_the_square(scheme)};
}

double apart_m(const BodyState& a, const BodyState& b) {
  return std::max((a.position.xyz - b.position.xyz).norm(),
                  1000 * a.ecef_from_body.quaternion.angularDistance(b.ecef_from_body.quaternion));
}

}  // namespace nadir::bench
