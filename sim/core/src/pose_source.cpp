#include "nadir/sim/pose_source.h"

namespace nadir::sim {

VehicleState vehicle_state(std::int64_t time_ns,
                           const geodesy::Pose<geodesy::frame::Ecef, geodesy::frame::Body>& ecef_from_body) {
  VehicleState state;
  state.time_ns = time_ns;
  state.ecef_from_body = ecef_from_body;
  state.place = geodesy::geodetic_from_ecef({ecef_from_body.origin});
  state.attitude =
      geodesy::yaw_pitch_roll_from(geodesy::ecef_from_ned(state.place).rotation.conjugate() * ecef_from_body.rotation);
  return state;
}

}  // namespace nadir::sim
