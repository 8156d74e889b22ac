#pragma once

#include <Eigen/Core>

namespace nadir::sim {

/// How the air moves around a vehicle: against the ground, along north, east and down at its place.
struct AirMotion {
  Eigen::Vector3d velocity_ned_mps = Eigen::Vector3d::Zero();  // where the air goes: (0, 5, 0) blows from the west
  Eigen::Vector3d rates_ned_radps = Eigen::Vector3d::Zero();   // how it turns, as a body that it carried would

  AirMotion() = default;
  /// Wind alone: air that does not turn.
  AirMotion(const Eigen::Vector3d& towards_ned_mps) : velocity_ned_mps(towards_ned_mps) {}
  AirMotion(const Eigen::Vector3d& towards_ned_mps, const Eigen::Vector3d& turning_ned_radps)
      : velocity_ned_mps(towards_ned_mps), rates_ned_radps(turning_ned_radps) {}

  AirMotion& operator+=(const AirMotion& other) {
    velocity_ned_mps += other.velocity_ned_mps;
    rates_ned_radps += other.rates_ned_radps;
    return *this;
  }
};

/// The air from one instant to another: changing evenly between them, as at the nearer one outside.
class AirOverTime {
 public:
  AirOverTime() = default;
  AirOverTime(const AirMotion& always) : from_(always), to_(always) {}
  AirOverTime(const Eigen::Vector3d& always_towards_ned_mps) : AirOverTime(AirMotion(always_towards_ned_mps)) {}
  /// `until_s` after `since_s`.
  AirOverTime(double since_s, const AirMotion& from, double until_s, const AirMotion& to)
      : since_s_(since_s), until_s_(until_s), from_(from), to_(to) {}

  AirMotion at(double time_s) const {
    if (time_s <= since_s_) return from_;
    if (time_s >= until_s_) return to_;
    const double share = (time_s - since_s_) / (until_s_ - since_s_);
    return {from_.velocity_ned_mps + share * (to_.velocity_ned_mps - from_.velocity_ned_mps),
            from_.rates_ned_radps + share * (to_.rates_ned_radps - from_.rates_ned_radps)};
  }
  const AirMotion& end() const { return to_; }

 private:
  double since_s_ = 0, until_s_ = 0;
  AirMotion from_, to_;
};

}  // namespace nadir::sim
