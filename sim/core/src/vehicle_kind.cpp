#include "vehicle_kind.h"

#include "nadir/sim/gain_design.h"
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

}  // namespace nadir::sim
