#include "nadir/render/homography.h"

#include <Eigen/LU>
#include <cmath>

namespace nadir::render {

Eigen::Matrix2d jacobian(const Eigen::Matrix3d& h, const Eigen::Vector2d& p) {
  const Eigen::Vector3d q = h * p.homogeneous();
  const Eigen::Vector2d image = q.head<2>() / q.z();
  return (h.topLeftCorner<2, 2>() - image * h.row(2).head<2>()) / q.z();
}

std::optional<Eigen::Matrix3d> homography_from_rectangle(double w, double h,
                                                         const std::array<Eigen::Vector2d, 4>& corners) {
  // A turn of one sense at each corner: convex, and of some area.
  const auto cross = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); };
  double smallest = std::numeric_limits<double>::infinity(), largest = -smallest;
  for (std::size_t i = 0; i < 4; ++i) {
    const double turn = cross(corners[(i + 1) % 4] - corners[i], corners[(i + 2) % 4] - corners[(i + 1) % 4]);
    if (!std::isfinite(turn)) return std::nullopt;
    smallest = std::min(smallest, turn);
    largest = std::max(largest, turn);
  }
  if (!(smallest > 0 || largest < 0)) return std::nullopt;

  const Eigen::Vector2d d1 = corners[1] - corners[2], d2 = corners[3] - corners[2];
  const Eigen::Vector2d sum = corners[0] - corners[1] + corners[2] - corners[3];
  const double g = cross(sum, d2) / cross(d1, d2), k = cross(d1, sum) / cross(d1, d2);
  Eigen::Matrix3d from_unit_square;
  from_unit_square.col(0) << corners[1] - corners[0] + g * corners[1], g;
  from_unit_square.col(1) << corners[3] - corners[0] + k * corners[3], k;
  from_unit_square.col(2) << corners[0], 1;
  Eigen::Matrix3d result = from_unit_square * Eigen::Vector3d(1 / w, 1 / h, 1).asDiagonal();
  if (!result.allFinite()) return std::nullopt;
  return result;
}

Eigen::Matrix3d with_centres_at_integers(const Eigen::Matrix3d& a_from_b) {
  Eigen::Matrix3d plus = Eigen::Matrix3d::Identity(), minus = plus;
  plus(0, 2) = plus(1, 2) = 0.5;
  minus(0, 2) = minus(1, 2) = -0.5;
  const Eigen::Matrix3d m = minus * a_from_b * plus;
  return m / m(2, 2);
}

}  // namespace nadir::render
