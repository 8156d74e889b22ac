#include "reference_chain.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

namespace nadir::bench {
namespace {

using Real = ReferenceChain::Real;
using Vector2 = ReferenceChain::Vector2;
using Vector3 = ReferenceChain::Vector3;

constexpr Real semi_major_m = 6378137, flattening = 1 / 298.257223563L;  // WGS-84
constexpr Real e2 = flattening * (2 - flattening);

Vector3 normal_at(const Eigen::Vector2d& lon_lat_rad) {
  const Real lon = lon_lat_rad.x(), lat = lon_lat_rad.y();
  return {std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat)};
}

Eigen::Matrix<Real, 3, 3> rotation_of(const Eigen::Quaterniond& q) {
  return Eigen::Quaternion<Real>(q.w(), q.x(), q.y(), q.z()).normalized().toRotationMatrix();
}

}  // namespace

ReferenceChain::ReferenceChain(const render::ExactChain& chain)
    : camera_(chain.camera()),
      surface_(chain.surface()),
      ecef_from_camera_(rotation_of(chain.ecef_from_camera().rotation)),
      position_(chain.ecef_from_camera().origin.cast<Real>()) {
  const geodesy::Geodetic& origin = surface_.frame().origin();
  const Eigen::Vector2d place(origin.lon_rad, origin.lat_rad);
  plane_normal_ = normal_at(place);
  plane_point_ = ecef(place, surface_.height_m());
}

Vector3 ReferenceChain::ecef(const Eigen::Vector2d& lon_lat_rad, Real height_m) const {
  const Vector3 normal = normal_at(lon_lat_rad);
  const Real n = semi_major_m / std::sqrt(1 - e2 * normal.z() * normal.z());
  return {(n + height_m) * normal.x(), (n + height_m) * normal.y(), (n * (1 - e2) + height_m) * normal.z()};
}

Vector3 ReferenceChain::ground(const Eigen::Vector2d& lon_lat_rad) const {
  if (surface_.ellipsoid()) return ecef(lon_lat_rad, surface_.height_m());
  // Along the ellipsoid's normal at the place, up or down to the plane
  const Vector3 foot = ecef(lon_lat_rad, 0), normal = normal_at(lon_lat_rad);
  return foot + normal * ((plane_point_ - foot).dot(plane_normal_) / normal.dot(plane_normal_));
}

std::optional<Vector2> ReferenceChain::through_lens(const Vector3& ray) const {
  const render::Lens& lens = camera_.lens();
  const auto k = [&](std::size_t i) { return static_cast<Real>(lens.coefficients()[i]); };
  const Real aside = std::hypot(ray.x(), ray.y());
  if (lens.model() == render::LensModel::equidistant) {
    if (aside == 0) return Vector2(0, 0);
    const Real t = std::atan2(aside, ray.z()), s = t * t;
    const Real distance = t * (1 + k(0) * s + k(1) * s * s + k(2) * s * s * s + k(3) * s * s * s * s);
    return Vector2(ray.x() * distance / aside, ray.y() * distance / aside);
  }
  if (!(ray.z() > 0)) return std::nullopt;
  const Real x = ray.x() / ray.z(), y = ray.y() / ray.z(), s = x * x + y * y;
  Real f = 1 + k(0) * s + k(1) * s * s + k(4) * s * s * s;
  if (lens.model() == render::LensModel::rational_polynomial) f /= 1 + k(5) * s + k(6) * s * s + k(7) * s * s * s;
  return Vector2(x * f + 2 * k(2) * x * y + k(3) * (s + 2 * x * x), y * f + k(2) * (s + 2 * y * y) + 2 * k(3) * x * y);
}

std::optional<Vector2> ReferenceChain::image_of(const Eigen::Vector2d& lon_lat_rad) const {
  const auto point = through_lens(ecef_from_camera_.transpose() * (ground(lon_lat_rad) - position_));
  if (!point) return std::nullopt;
  return Vector2(point->x() * camera_.fx_px() + camera_.principal_point_px().x(),
                 point->y() * camera_.fy_px() + camera_.principal_point_px().y());
}

double ReferenceChain::error_px(const Eigen::Vector2d& image, const Eigen::Vector2d& lon_lat_rad) const {
  const auto found = image_of(lon_lat_rad);
  if (!found || !found->allFinite()) return std::numeric_limits<double>::infinity();
  return static_cast<double>((*found - image.cast<Real>()).norm());
}

Real ReferenceChain::sinks_by_rad(const Eigen::Vector2d& image) const {
  const Vector3 ray =
      (ecef_from_camera_ * Vector3((image.x() - Real(camera_.principal_point_px().x())) / camera_.fx_px(),
                                   (image.y() - Real(camera_.principal_point_px().y())) / camera_.fy_px(), 1))
          .normalized();
  if (surface_.plane()) return std::asin(-ray.dot(plane_normal_));
  // Along the axes in which the ellipsoid of semi-axes longer by the height is a sphere
  const Vector3 per_semi_axis(1 / (semi_major_m + surface_.height_m()), 1 / (semi_major_m + surface_.height_m()),
                              1 / (semi_major_m * (1 - flattening) + surface_.height_m()));
  const Vector3 from = position_.cwiseProduct(per_semi_axis), towards = ray.cwiseProduct(per_semi_axis);
  if (!(from.norm() > 1)) return -1;
  return std::asin(1 / from.norm()) - std::atan2(from.cross(towards).norm(), -from.dot(towards));
}

}  // namespace nadir::bench
