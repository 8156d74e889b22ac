#include "vehicle_kind.h"

#include <cmath>

#include "flight_parts.h"
#include "nadir/sim/gain_design.h"
#include "nadir/sim/multirotor_control.h"
#include "nadir/sim/trim.h"

namespace nadir::sim {

FlightLimits flight_limits(const VehicleSetup& setup) {
  const FixedWing vehicle = setup.fixed_wing();
  constexpr double density_kgpm3 = 1.225, gravity_mps2 = 9.80665;  // at sea level: limits hardly hang on them
  FlightGains gains;
  if (const auto level = trim(vehicle, {.airspeed_mps = setup.airspeed_mps}, density_kgpm3, gravity_mps2))
    gains = designed_gains(vehicle, *level, density_kgpm3, gravity_mps2);
  setup.autopilot.apply(gains);
  return {.airspeed_mps = setup.airspeed_mps,
          .max_bank_rad = gains.autopilot.max_roll_rad,
          .max_climb_mps = gains.autopilot.max_climb_mps};
}

Result<double> level_pitch_rad(const RunFile& run, const VehicleSetup& setup, double airspeed_mps,
                               const geodesy::Point<geodesy::frame::Ecef>& place) {
  const geodesy::Geodetic here = geodesy::geodetic_from_ecef(place);
  const auto level = trim(setup.fixed_wing(), {.airspeed_mps = airspeed_mps},
                          run.flat_earth ? Environment::flat(here) : Environment::wgs84(), here);
  if (!level) return fail(level);
  return level->pitch_rad;
}

Result<MultirotorTrim> multirotor_steady(const RunFile& run, const VehicleSetup& setup, double yaw_rad,
                                         const Eigen::Vector3d& through_air_ned_mps, const render::Surface& ground,
                                         const geodesy::Point<geodesy::frame::Ecef>& place) {
  const auto environment = environment_of(run, ground.frame(), geodesy::geodetic_from_ecef(place));
  if (!environment) return fail(environment);
  const Surroundings here = environment->at(place);
  const Multirotor vehicle = setup.multirotor_vehicle();
  const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
  const Eigen::Vector3d& v = through_air_ned_mps;
  const MultirotorTrimTarget target{c * v.x() + s * v.y(), c * v.y() - s * v.x(), -v.z()};
  auto steady = trim(vehicle, target, here.density_kgpm3, here.gravity_ecef_mps2.norm(),
                     vehicle.battery ? vehicle.battery->capacity_ah : 0);
  if (!steady) return fail(steady);
  if (std::acos(std::cos(steady->pitch_rad) * std::cos(steady->roll_rad)) > MultirotorGains().max_tilt_rad)
    return fail(Error::Kind::Unsupported, "it would lean too far");
  return steady;
}

FlightLimits multirotor_limits(const RunFile& run, const VehicleSetup& setup, const render::Surface& ground,
                               const geodesy::Point<geodesy::frame::Ecef>& place) {
  // By halves: the fastest flight that there is
  const auto fastest = [&](const Eigen::Vector3d& direction_ned) {
    double slow = 0, fast = 100;
    for (int i = 0; i < 14; ++i) {
      const double middle = (slow + fast) / 2;
      (multirotor_steady(run, setup, 0, middle * direction_ned, ground, place) ? slow : fast) = middle;
    }
    return slow;
  };
  FlightLimits limits;
  limits.max_airspeed_mps = fastest({1, 0, 0});
  limits.max_climb_mps = fastest({0, 0, -1});
  limits.near_ground_m = 2;
  return limits;
}

}  // namespace nadir::sim
