// Motions with known answers, for tests of integrators.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace nadir::sim {

/// x' = rate (x - cos t) - sin t, whose solution from 1 is cos t however large the rate. Source: Prothero and Robinson,
/// On the stability and accuracy of one-step methods, 1974.
struct ProtheroRobinson {
  using Vector = Eigen::Matrix<double, 1, 1>;
  double rate = -1e4;
  Vector operator()(double t, const Vector& x) const { return Vector(rate * (x[0] - std::cos(t)) - std::sin(t)); }
};

/// Van der Pol's oscillator in the time of its slow phase: y'' = ((1 - y^2) y' - y) / eps, eps = 1/mu^2.
struct VanDerPol {
  static constexpr bool autonomous = true;
  double eps = 1e-8;
  Eigen::Vector2d operator()(double, const Eigen::Vector2d& y) const {
    return {y[1], ((1 - y[0] * y[0]) * y[1] - y[0]) / eps};
  }
};

/// A planet around a mass of 1: position and velocity.
struct Kepler {
  static constexpr bool autonomous = true;
  Eigen::Vector4d operator()(double, const Eigen::Vector4d& x) const {
    const double r2 = x[0] * x[0] + x[1] * x[1], r3 = r2 * std::sqrt(r2);
    return {x[2], x[3], -x[0] / r3, -x[1] / r3};
  }
  /// At the point nearest to the mass; a turn takes 2 pi.
  static Eigen::Vector4d start(double eccentricity) {
    return {1 - eccentricity, 0, 0, std::sqrt((1 + eccentricity) / (1 - eccentricity))};
  }
  static double energy(const Eigen::Vector4d& x) { return 0.5 * x.tail<2>().squaredNorm() - 1 / x.head<2>().norm(); }
};

/// Depends on time and on the state: x = exp(sin 3t).
struct Breathing {
  using Vector = Eigen::Matrix<double, 1, 1>;
  Vector operator()(double t, const Vector& x) const { return 3 * std::cos(3 * t) * x; }
  static double at(double t) { return std::exp(std::sin(3 * t)); }
};

/// A motor: current with the time constant `electrical_s`, speed with a slow one, voltage held. All linear.
struct Motor {
  static constexpr bool autonomous = true;
  double voltage = 10;
  double electrical_s = 2e-4, mechanical_s = 5;
  Eigen::Vector2d operator()(double, const Eigen::Vector2d& x) const {
    return {(voltage - 0.02 * x[1] - x[0]) / electrical_s, (50 * x[0] - x[1]) / mechanical_s};
  }
};

}  // namespace nadir::sim
