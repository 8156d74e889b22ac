#include "nadir/sim/navigation.h"

#include <cmath>

namespace nadir::sim {
using Eigen::Vector3d;

Navigation true_navigation(const BodyState& state, const Environment& environment, const Vector3d& wind_ned_mps,
                           const geodesy::LocalFrame& scene) {
  const Surroundings here = environment.at(state.position);
  const Vector3d p_enu = (scene.enu_from_ecef() * state.position).xyz;
  const Vector3d velocity_ned = here.ecef_from_ned.transpose() * state.velocity.xyz;
  const Eigen::Matrix3d ned_from_body =
      here.ecef_from_ned.transpose() * state.ecef_from_body.quaternion.toRotationMatrix();

  Navigation out;
  out.north_m = p_enu.y();
  out.east_m = p_enu.x();
  out.height_m = p_enu.z();
  out.course_rad = std::atan2(velocity_ned.y(), velocity_ned.x());
  out.ground_speed_mps = std::hypot(velocity_ned.x(), velocity_ned.y());
  out.climb_rate_mps = -velocity_ned.z();
  out.airspeed_mps = (velocity_ned - wind_ned_mps).norm();
  out.attitude = geodesy::yaw_pitch_roll_from(Eigen::Quaterniond(ned_from_body));
  out.rates_radps = state.body_rates_radps;
  return out;
}

}  // namespace nadir::sim
