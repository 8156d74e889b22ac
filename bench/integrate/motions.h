#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>

namespace nadir::bench {

/// A motion of `n` components, flown in intervals within which its inputs are held or smooth.
template <int n>
struct Motion {
  using Vector = Eigen::Matrix<double, n, 1>;
  using Derivative = std::function<Vector(double, const Vector&)>;
  std::string name;
  Vector start;
  double interval_s = 0;
  int intervals = 0;
  std::function<Derivative(int)> derivative_of;  // in an interval
  Vector counted;                                // share of each component in the error, 0: none
  std::string unit;                              // of that error
  Vector one;                                    // what a tolerance of 1 allows each component
  int most_steps = 64;                           // of an interval, where they are fixed

  double error(const Vector& found, const Vector& exact) const { return (found - exact).cwiseProduct(counted).norm(); }
};

Motion<2> harmonic();
/// Without torque: rates and quaternion. The middle axis is near that of the rates, where the body tumbles.
Motion<7> rigid_body();
/// Current and speed of a motor with a propeller: electrical time constant 0.2 ms, mechanical 2.4 s, voltage in steps
/// at 100 Hz.
Motion<2> motor();
/// Height and speed of a body of 11 kg and of its wheel of 0.1 kg, dropped from 10 cm on a tyre of 1e6 N/m.
Motion<4> landing_gear();

/// The Aerosonde over WGS-84, 3000 m up, from trimmed flight at 25 m/s: position from the start, and the other
/// components of a body's state; the servos' lag is exact. Error: of position, m.
enum class Flight { Cruise, Roll, Stall, Gust, Drop };
Motion<13> aerosonde_in(Flight flight);

/// The quadrotor of 3.5 kg over WGS-84, from hover, its throttles swinging by 2 % each at its own pace: position from
/// the start and the other components of a body's state. Error: of position, m.
Motion<13> hover();
/// The same with motors that turn 2e-4 kg m^2 and have windings of 0.2 ms: four speeds and four currents more. The
/// fastest and the slowest of its rates are apart by more than 1e4.
Motion<21> hover_with_windings();

}  // namespace nadir::bench
