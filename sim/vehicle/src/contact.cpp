#include "nadir/sim/contact.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace nadir::sim {
using Eigen::Vector3d;

std::vector<ParameterFault> faults_of(const ContactPoint& p) {
  std::vector<ParameterFault> faults;
  const auto within = [&](const char* key, double value, double low, double high, const char* unit) {
    if (!(value >= low && value <= high))
      faults.push_back({key, fmt::format("expected {:g} to {:g}{}, found {:g}", low, high, unit, value)});
  };
  for (const double x : p.body_m) within("place_m", x, -1000, 1000, " m");
  if (p.kind == ContactPoint::Kind::Part) return faults;
  within("stiffness_npm", p.stiffness_npm, 1, 1e8, " N/m");
  within("damping_spm", p.damping_spm, 0, 100, " s/m");
  within("friction", p.friction, 0, 10, "");
  within("most_n", p.most_n, 0, 1e9, " N");
  if (p.kind != ContactPoint::Kind::Wheel) return faults;
  within("rolling_friction", p.rolling_friction, 0, p.friction, "");
  within("brake_friction", p.rolling_friction + p.brake_friction, p.rolling_friction, p.friction,
         " with rolling_friction");
  within("slip_rad", p.slip_rad, 0, 1, " rad");
  within("steering", p.steering, -1, 1, "");
  return faults;
}

Result<ContactGear> ContactGear::create(std::vector<ContactPoint> points) {
  std::vector<std::string> faults;
  if (points.size() > 32) faults.push_back(fmt::format("expected at most 32 contact points, found {}", points.size()));
  for (const ContactPoint& p : points)
    for (const ParameterFault& fault : faults_of(p))
      faults.push_back(fmt::format("{}: {}: {}", p.name, fault.key, fault.message));
  if (!faults.empty()) return fail(Error::Kind::Malformed, fmt::format("landing gear: {}", fmt::join(faults, "; ")));
  ContactGear gear;
  gear.points_ = std::move(points);
  for (const ContactPoint& p : gear.points_) gear.reach_m_ = std::max(gear.reach_m_, p.body_m.norm());
  return gear;
}

namespace {

/// Forces over the normal force along two axes of the ground: `along` the rolling direction and across it.
struct Shares {
  double along = 0, across = 0;
};

Shares wheel_friction(const ContactPoint& p, double along_mps, double across_mps, double brake) {
  constexpr double s2 = friction_speed_mps * friction_speed_mps;
  const double slip_mps = p.slip_rad * along_mps;
  Shares f{-(p.rolling_friction + brake * p.brake_friction) * along_mps / std::sqrt(along_mps * along_mps + s2),
           -p.friction * across_mps / std::sqrt(across_mps * across_mps + slip_mps * slip_mps + s2)};
  // Braking and turning share what the tyre can hold
  const double both = std::hypot(f.along, f.across);
  if (both > p.friction) f.along *= p.friction / both, f.across *= p.friction / both;
  return f;
}

}  // namespace

ContactForce contact_force(const ContactPoint& p, const ContactMotion& m, const GearCommand& command) {
  if (m.depth_m <= 0 || p.kind == ContactPoint::Kind::Part) return {};
  const double sinking_mps = -m.normal.dot(m.velocity_mps);
  const double normal_n = p.stiffness_npm * m.depth_m * std::max(0.0, 1 + p.damping_spm * sinking_mps);
  const Vector3d sliding = m.velocity_mps + sinking_mps * m.normal;

  ContactForce out{normal_n * m.normal, normal_n};
  if (p.kind == ContactPoint::Kind::Wheel) {
    // Where the wheel's plane meets the ground; a wheel that lies flat on it slides
    const double turned = p.steering * command.steering_rad;
    const Vector3d heading = std::cos(turned) * m.forward - std::sin(turned) * m.up.cross(m.forward);
    const Vector3d level = heading - m.normal.dot(heading) * m.normal;
    const double length = level.norm();
    if (length > 0.1) {
      const Vector3d along = level / length, across = m.normal.cross(along);
      const Shares share =
          wheel_friction(p, along.dot(sliding), across.dot(sliding), std::clamp(command.brake, 0.0, 1.0));
      out.force_n += normal_n * (share.along * along + share.across * across);
      return out;
    }
  }
  out.force_n -=
      (p.friction * normal_n / std::sqrt(sliding.squaredNorm() + friction_speed_mps * friction_speed_mps)) * sliding;
  return out;
}

double restitution(double damping_spm, double impact_mps) {
  const double in = damping_spm * impact_mps;
  if (in < 1e-6) return 1 - 2 * in / 3;
  const double left = in - std::log1p(in);
  double low = 0, high = std::min(in, 1.0);  // of c e v; what leaves is slower than 1 / c
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (-middle - std::log1p(-middle) < left ? low : high) = middle;
  }
  return 0.5 * (low + high) / in;
}

double standing_height_m(const ContactGear& gear) {
  double lowest_m = 0;
  for (const ContactPoint& point : gear.points())
    if (point.kind != ContactPoint::Kind::Part) lowest_m = std::max(lowest_m, point.body_m.z());
  return lowest_m;
}

}  // namespace nadir::sim
