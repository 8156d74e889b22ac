#pragma once

#include <Eigen/Geometry>

namespace nadir::geodesy {

/// Frames of reference, as tags: a point, direction or pose carries its frame in its type, so
/// that a product of the wrong frames does not compile. All right-handed, all in metres.
namespace frame {
struct Ecef {};    // earth-centred earth-fixed, WGS-84
struct Enu {};     // east-north-up on the tangent plane at the scene origin
struct Ned {};     // north-east-down at the vehicle's own position
struct Body {};    // forward-right-down
struct Mount {};   // forward-right-down of the camera's mount; equals Body where the mount is not turned
struct Camera {};  // x right, y down, z along the optical axis
}  // namespace frame

/// A point's coordinates in frame F, metres.
template <class F>
struct Point {
  Eigen::Vector3d xyz;
};

/// A direction in frame F; of unit length only where that is said.
template <class F>
struct Direction {
  Eigen::Vector3d xyz;
};

/// Rotation taking coordinates in B to coordinates in A. Unit quaternion.
template <class A, class B>
struct Rotation {
  Eigen::Quaterniond quaternion = Eigen::Quaterniond::Identity();
  Rotation<B, A> inverse() const { return {quaternion.conjugate()}; }
};

/// Rigid motion taking coordinates in B to coordinates in A.
template <class A, class B>
struct Pose {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  // unit length
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();              // of B, expressed in A, metres

  Pose<B, A> inverse() const {
    const Eigen::Quaterniond back = rotation.conjugate();
    return {back, -(back * origin)};
  }
};

template <class A, class B>
Point<A> operator*(const Pose<A, B>& a_from_b, const Point<B>& p_b) {
  return {a_from_b.rotation * p_b.xyz + a_from_b.origin};
}
template <class A, class B>
Direction<A> operator*(const Pose<A, B>& a_from_b, const Direction<B>& d_b) {
  return {a_from_b.rotation * d_b.xyz};
}
template <class A, class B, class C>
Pose<A, C> operator*(const Pose<A, B>& a_from_b, const Pose<B, C>& b_from_c) {
  return {(a_from_b.rotation * b_from_c.rotation).normalized(), a_from_b.rotation * b_from_c.origin + a_from_b.origin};
}
template <class A, class B, class C>
Rotation<A, C> operator*(const Rotation<A, B>& a_from_b, const Rotation<B, C>& b_from_c) {
  return {(a_from_b.quaternion * b_from_c.quaternion).normalized()};
}
template <class A, class B>
Direction<A> operator*(const Rotation<A, B>& a_from_b, const Direction<B>& d_b) {
  return {a_from_b.quaternion * d_b.xyz};
}

}  // namespace nadir::geodesy
