#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/sim/parameter_fault.h"
#include "nadir/sim/rigid_body.h"

namespace nadir::sim {

/// A point of a vehicle that can meet the ground: a wheel, a skid, or a part that must not.
struct ContactPoint {
  enum class Kind {
    Wheel,  // rolls forwards and backwards, holds sideways
    Skid,   // slides either way
    Part,   // may not touch: where it does, the vehicle has crashed, and no force of it is asked for
  };
  std::string name;
  Kind kind = Kind::Skid;
  Eigen::Vector3d body_m = Eigen::Vector3d::Zero();  // lowest point of the unloaded wheel; forward, right, down
  double stiffness_npm = 0;
  /// Damping of Hunt and Crossley: the force is k d (1 + c v) at a depth d that grows by v. It begins at zero with the
  /// depth, whatever the speed, and never pulls. About 2/3 c v of a small impact's speed v is lost.
  double damping_spm = 0;
  double friction = 0.8;           // of a skid; of a wheel across its plane, and the most it holds in any direction
  double rolling_friction = 0.03;  // of a wheel along its plane
  double brake_friction = 0;       // added to that by the whole brake
  double slip_rad = 0.1;           // slip angle of a rolling wheel where it holds 0.7 of what it can
  double steering = 0;             // share of the steering angle that turns the wheel: -1 behind, 1 in front
  double most_n = 0;               // a greater force breaks it; 0: nothing does
};

/// A coefficient outside its range, a stiffness above 1e8 N/m, by the member's name; `place_m` is where it is.
std::vector<ParameterFault> faults_of(const ContactPoint& point);

/// Coulomb's friction is reached from rest over this speed, so that force is a function of velocity: under a load of
/// the share s of what friction can hold, a point creeps at s times this. Source of the form: Quinn, A new
/// regularization of Coulomb friction, 2004, with the square root for the hyperbolic tangent.
inline constexpr double friction_speed_mps = 1e-4;

/// Of the whole gear.
struct GearCommand {
  double steering_rad = 0;  // clockwise from above
  double brake = 0;         // [0, 1]
  friend bool operator==(const GearCommand&, const GearCommand&) = default;
};

/// Where all points that can meet the ground are, and what becomes of them.
class ContactGear {
 public:
  /// Fails with all that is wrong with the points (`faults_of`), or with more than 32 of them.
  static Result<ContactGear> create(std::vector<ContactPoint> points);
  /// None: the airframe itself, at its centre of mass, which may not touch.
  ContactGear() : points_{{.name = "airframe", .kind = ContactPoint::Kind::Part}} {}

  const std::vector<ContactPoint>& points() const { return points_; }
  double reach_m() const { return reach_m_; }  // of the farthest point from the centre of mass

 private:
  std::vector<ContactPoint> points_;
  double reach_m_ = 0;
};

/// Under the centre of mass is the lowest skid or wheel so far; 0: it has none.
double standing_height_m(const ContactGear& gear);

/// A point's motion against the plane of ground under it.
struct ContactMotion {
  double depth_m = 0;                   // positive in the ground
  Eigen::Vector3d velocity_mps;         // of the point against the ground
  Eigen::Vector3d normal, forward, up;  // of the ground; the vehicle's own, all in the axes of the velocity
};

/// Force on a point, in the axes of its motion, and its part along the normal.
struct ContactForce {
  Eigen::Vector3d force_n = Eigen::Vector3d::Zero();
  double normal_n = 0;
};
ContactForce contact_force(const ContactPoint& point, const ContactMotion& motion, const GearCommand& command);

/// Share of an impact's speed that is left after it, without other forces: 1 - 2/3 c v and less. Solves the phase
/// portrait of Hunt and Crossley, Coefficient of restitution interpreted as damping in vibroimpact, 1975:
/// c v - ln(1 + c v) = -c e v - ln(1 - c e v).
double restitution(double damping_spm, double impact_mps);

}  // namespace nadir::sim
