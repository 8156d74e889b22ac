#include "nadir/render/motion.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace nadir::render {

Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& rotation) {
  const Eigen::Quaterniond shorter(rotation.w() < 0 ? -rotation.coeffs() : rotation.coeffs());
  const double sine = shorter.vec().norm();
  if (sine == 0) return Eigen::Vector3d::Zero();
  return shorter.vec() * (2 * std::atan2(sine, shorter.w()) / sine);
}

Eigen::Quaterniond rotation_by(const Eigen::Vector3d& rotation_vector) {
  const double angle = rotation_vector.norm();
  if (angle == 0) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, rotation_vector / angle));
}

Result<void> check(const Shutter& shutter) {
  constexpr double longest_s = 3600;
  const auto valid = [](double seconds) { return seconds >= 0 && seconds <= longest_s; };
  if (!valid(shutter.exposure_s))
    return fail(Error::Kind::Malformed,
                fmt::format("exposure: expected seconds in [0, {}], found {}", longest_s, shutter.exposure_s));
  if (!valid(shutter.readout_s))
    return fail(Error::Kind::Malformed,
                fmt::format("readout: expected seconds in [0, {}], found {}", longest_s, shutter.readout_s));
  return {};
}

Result<CameraPose> checked_pose(const CameraPose& pose) {
  const double length = pose.rotation.norm();
  if (!pose.origin.allFinite() || !(std::abs(length - 1) < 1e-3))
    return fail(Error::Kind::Malformed,
                fmt::format("pose: expected a finite position and a unit quaternion, found a length of {}", length));
  // What is a unit quaternion but for rounding stays as it is: truth gives back the bits that came in.
  if (std::abs(length - 1) < 1e-14) return pose;
  return CameraPose{pose.rotation.normalized(), pose.origin};
}

Result<CameraMotion> CameraMotion::through(std::vector<Moment> moments) {
  if (moments.size() < 2)
    return fail(Error::Kind::Malformed,
                fmt::format("camera motion: expected at least 2 moments, found {}", moments.size()));
  for (std::size_t i = 0; i < moments.size(); ++i) {
    if (!std::isfinite(moments[i].time_s) || (i > 0 && !(moments[i].time_s > moments[i - 1].time_s)))
      return fail(Error::Kind::Malformed, fmt::format("camera motion: moment {}: expected a time after that of the "
                                                      "moment before, found {} s",
                                                      i, moments[i].time_s));
    const auto pose = checked_pose(moments[i].ecef_from_camera);
    if (!pose) return fail(pose.error().kind, fmt::format("camera motion: moment {}: {}", i, pose.error().message));
    moments[i].ecef_from_camera = *pose;
  }
  return CameraMotion(std::move(moments));
}

CameraMotion CameraMotion::from(double time_s) const {
  CameraMotion shifted = *this;
  shifted.zero_s_ += time_s;
  return shifted;
}

/// Index of the moment before, among those that have one after them.
std::size_t CameraMotion::segment(double time_s) const {
  const auto after = std::upper_bound(moments_->begin(), moments_->end(), time_s,
                                      [](double t, const Moment& moment) { return t < moment.time_s; });
  const auto before = std::max<std::ptrdiff_t>(after - moments_->begin() - 1, 0);
  return std::min(static_cast<std::size_t>(before), moments_->size() - 2);
}

CameraPose CameraMotion::at(double time_s) const {
  const double t = time_s + zero_s_;
  const std::size_t i = segment(t);
  const Moment &a = (*moments_)[i], &b = (*moments_)[i + 1];
  const double s = (t - a.time_s) / (b.time_s - a.time_s);
  const CameraPose &from = a.ecef_from_camera, &to = b.ecef_from_camera;
  if (s == 0) return from;
  if (s == 1) return to;
  const Eigen::Vector3d turn = rotation_vector(from.rotation.conjugate() * to.rotation);
  return {(from.rotation * rotation_by(s * turn)).normalized(), from.origin + s * (to.origin - from.origin)};
}

std::vector<double> CameraMotion::moments_between(double from_s, double to_s) const {
  std::vector<double> times;
  for (std::size_t i = segment(from_s + zero_s_) + 1; i + 1 < moments_->size(); ++i) {  // the ends are no changes
    const double time_s = (*moments_)[i].time_s - zero_s_;
    if (time_s >= to_s) break;
    if (time_s > from_s) times.push_back(time_s);
  }
  return times;
}

double CameraMotion::turn_rad(double from_s, double to_s) const {
  const double start = from_s + zero_s_, end = to_s + zero_s_;
  double sum = 0;
  const std::size_t last = segment(end);
  for (std::size_t i = segment(start); i <= last; ++i) {
    const Moment &a = (*moments_)[i], &b = (*moments_)[i + 1];
    const double enters = i == segment(start) ? start : a.time_s, leaves = i == last ? end : b.time_s;
    const double turn_rad =
        rotation_vector(a.ecef_from_camera.rotation.conjugate() * b.ecef_from_camera.rotation).norm();
    sum += turn_rad * (leaves - enters) / (b.time_s - a.time_s);
  }
  return sum;
}

}  // namespace nadir::render
