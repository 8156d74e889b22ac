#pragma once

#include <Eigen/Core>
#include <array>

namespace nadir::render {

/// A map of the plane whose coordinates are quadratic along either axis of a rectangle [0, w] x [0, h].
class Biquadratic {
 public:
  Biquadratic() = default;

  /// The one that takes the lattice of corners, edges' middles and the middle to `values`: row by row, three each.
  Biquadratic(double w, double h, const std::array<Eigen::Vector2d, 9>& values) : per_unit_(1 / w, 1 / h) {
    // Quadratics through (0, a), (1/2, b), (1, c): a + (4b - 3a - c) s + 2 (a - 2b + c) s^2, first along rows
    std::array<Eigen::Vector2d, 9> rows;
    for (std::size_t j = 0; j < 3; ++j) through(values[3 * j], values[3 * j + 1], values[3 * j + 2], &rows[3 * j], 1);
    for (std::size_t i = 0; i < 3; ++i) through(rows[i], rows[3 + i], rows[6 + i], &terms_[i], 3);
  }

  Eigen::Vector2d operator()(const Eigen::Vector2d& p) const {
    const double s = p.x() * per_unit_.x(), t = p.y() * per_unit_.y();
    return along(0, s) + t * (along(3, s) + t * along(6, s));
  }

  /// Along the row at `y`: the terms of 1, x and x^2.
  std::array<Eigen::Vector2d, 3> row(double y) const {
    const double t = y * per_unit_.y();
    std::array<Eigen::Vector2d, 3> of_x;
    double unit = 1;
    for (std::size_t i = 0; i < 3; ++i) {
      of_x[i] = unit * (terms_[i] + t * (terms_[3 + i] + t * terms_[6 + i]));
      unit *= per_unit_.x();
    }
    return of_x;
  }

  /// Columns are the steps per unit of x and of y.
  Eigen::Matrix2d jacobian(const Eigen::Vector2d& p) const {
    const double s = p.x() * per_unit_.x(), t = p.y() * per_unit_.y();
    Eigen::Matrix2d j;
    j.col(0) = (slope(0, s) + t * (slope(3, s) + t * slope(6, s))) * per_unit_.x();
    j.col(1) = (along(3, s) + 2 * t * along(6, s)) * per_unit_.y();
    return j;
  }

  friend bool operator==(const Biquadratic&, const Biquadratic&) = default;

 private:
  static void through(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
                      Eigen::Vector2d* out, std::size_t step) {
    out[0] = a;
    out[step] = 4 * b - 3 * a - c;
    out[2 * step] = 2 * (a - 2 * b + c);
  }
  Eigen::Vector2d along(std::size_t row, double s) const {
    return terms_[row] + s * (terms_[row + 1] + s * terms_[row + 2]);
  }
  Eigen::Vector2d slope(std::size_t row, double s) const { return terms_[row + 1] + 2 * s * terms_[row + 2]; }

  Eigen::Vector2d per_unit_ = Eigen::Vector2d::Zero();
  std::array<Eigen::Vector2d, 9> terms_{};  // of s^i t^j at 3 j + i, s and t running over [0, 1]
};

}  // namespace nadir::render
