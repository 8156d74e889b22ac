#include "nadir/sim/flight_event.h"
#include "nadir/base/time.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "nadir/geodesy/attitude.h"
#include "nadir/geodesy/geodetic.h"
#include "nadir/sim/navigation.h"

namespace nadir::sim {
using geodesy::to_degrees;

std::string in_words(const FlightEvent& event) {
  return fmt::format("{} at {:.3f} s: {}", event.name, seconds_from_ns(event.time_ns), event.text);
}

std::string in_words(const BodyState& body, const Environment& environment, const AirMotion& air) {
  const geodesy::Geodetic place = geodesy::geodetic_from_ecef(body.position);
  const Navigation now =
      true_navigation(body, environment, air.velocity_ned_mps, geodesy::LocalFrame({place.lat_rad, place.lon_rad, 0}));
  const Eigen::Vector3d rates_dps = (180 / std::numbers::pi) * now.rates_radps;
  return fmt::format(
      "at {:.7f}, {:.7f} deg, {:.2f} m above the ellipsoid; airspeed {:.2f} m/s, {} at {:.2f} m/s; yaw {:.1f}, pitch "
      "{:.1f}, roll {:.1f} deg; rates {:.1f}, {:.1f}, {:.1f} deg/s",
      to_degrees(place.lat_rad), to_degrees(place.lon_rad), place.height_m, now.airspeed_mps,
      now.climb_rate_mps < 0 ? "sinking" : "climbing", std::abs(now.climb_rate_mps), to_degrees(now.attitude.yaw_rad),
      to_degrees(now.attitude.pitch_rad), to_degrees(now.attitude.roll_rad), rates_dps.x(), rates_dps.y(),
      rates_dps.z());
}

std::string beyond_sense(const BodyState& body) {
  if (!to_vector(body).allFinite()) return "its state is not finite";
  const double speed_mps = body.velocity.xyz.norm(), rate_radps = body.body_rates_radps.norm();
  if (speed_mps > 1000) return fmt::format("it moves at {:.0f} m/s", speed_mps);
  if (rate_radps > 100) return fmt::format("it turns at {:.0f} rad/s", rate_radps);
  // Of a ball around the ellipsoid, which is no more than 21 km deep
  const double radius_m = body.position.xyz.norm();
  if (radius_m < 6'250'000 || radius_m > 6'478'137)
    return fmt::format("it is {:.0f} km from the Earth's centre", radius_m / 1000);
  return {};
}

}  // namespace nadir::sim
