#include "vehicle_kind.h"

#include "nadir/sim/autopilot.h"
#include "nadir/sim/trim.h"

namespace nadir::sim {

FlightLimits flight_limits(const VehicleSetup& setup) {
  const AutopilotGains gains;
  return {.airspeed_mps = setup.airspeed_mps, .max_bank_rad = gains.max_roll_rad, .max_climb_mps = gains.max_climb_mps};
}

Result<double> level_pitch_rad(const RunFile& run, const VehicleSetup&, double airspeed_mps,
                               const geodesy::Point<geodesy::frame::Ecef>& place) {
  const geodesy::Geodetic here = geodesy::geodetic_from_ecef(place);
  const auto level = trim(aerosonde(), {.airspeed_mps = airspeed_mps},
                          run.flat_earth ? Environment::flat(here) : Environment::wgs84(), here);
  if (!level) return fail(level);
  return level->pitch_rad;
}

}  // namespace nadir::sim
