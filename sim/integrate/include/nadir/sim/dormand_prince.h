#pragma once

#include <cmath>

#include "nadir/sim/derivative.h"
#include "nadir/sim/step_control.h"

namespace nadir::sim {

/// Runge-Kutta method of order 5 with an estimate of order 4, six evaluations a step. For motion that is not stiff:
/// where a rate of the system times the step passes 3.3, steps are cut for stability, and `stiffness` shows it.
/// Source: Dormand and Prince, A family of embedded Runge-Kutta formulae, 1980; interpolation: Hairer, Norsett and
/// Wanner, Solving Ordinary Differential Equations I, 1993, section II.6. For `Adaptive`.
template <class V>
class DormandPrince {
 public:
  using Vector = V;
  static constexpr const char* name = "dormand-prince";
  static constexpr const char* advice = "where it is stiff, an L-stable method takes fewer";
  static constexpr int error_order = 5;
  static constexpr double stability_limit = 3.3;  // of rate times step, on the negative real axis

  /// `like`: any vector of the size that is to come.
  explicit DormandPrince(const Vector& like) {
    for (Vector* v : {&k1_, &k2_, &k3_, &k4_, &k5_, &k6_, &k7_, &stage_, &error_, &before_, &next_})
      *v = Vector::Zero(like.size());
  }

  template <class F>
  void start(const F& f, double t_s, const Vector& x, Work& work) {
    evaluate(f, t_s, x, k1_, work);
    taken_ = false;
  }

  /// Estimated error of the step, in tolerances.
  template <class F>
  double attempt(const F& f, double t_s, const Vector& x, double h, const Tolerance<Vector>& tolerance, Work& work) {
    if (taken_) k1_.swap(k7_);  // the last evaluation of a step is the first one of the next
    taken_ = false;
    before_ = x;
    h_ = h;
    stage_ = x + h * (1.0 / 5) * k1_;
    evaluate(f, t_s + h / 5, stage_, k2_, work);
    stage_ = x + h * ((3.0 / 40) * k1_ + (9.0 / 40) * k2_);
    evaluate(f, t_s + h * (3.0 / 10), stage_, k3_, work);
    stage_ = x + h * ((44.0 / 45) * k1_ - (56.0 / 15) * k2_ + (32.0 / 9) * k3_);
    evaluate(f, t_s + h * (4.0 / 5), stage_, k4_, work);
    stage_ = x + h * ((19372.0 / 6561) * k1_ - (25360.0 / 2187) * k2_ + (64448.0 / 6561) * k3_ - (212.0 / 729) * k4_);
    evaluate(f, t_s + h * (8.0 / 9), stage_, k5_, work);
    stage_ = x + h * ((9017.0 / 3168) * k1_ - (355.0 / 33) * k2_ + (46732.0 / 5247) * k3_ + (49.0 / 176) * k4_ -
                      (5103.0 / 18656) * k5_);
    evaluate(f, t_s + h, stage_, k6_, work);
    next_ = x + h * ((35.0 / 384) * k1_ + (500.0 / 1113) * k3_ + (125.0 / 192) * k4_ - (2187.0 / 6784) * k5_ +
                     (11.0 / 84) * k6_);
    evaluate(f, t_s + h, next_, k7_, work);
    error_ = h * ((71.0 / 57600) * k1_ - (71.0 / 16695) * k3_ + (71.0 / 1920) * k4_ - (17253.0 / 339200) * k5_ +
                  (22.0 / 525) * k6_ - (1.0 / 40) * k7_);
    return in_tolerances(error_, x, next_, tolerance);
  }

  void accept() { taken_ = true; }
  const Vector& next() const { return next_; }
  const Vector& derivative() const { return taken_ ? k7_ : k1_; }

  /// The system's greatest rate along the last step times that step, from two stages at the same time: near
  /// `stability_limit` it is stability that limits the step, and the motion is stiff for this method. Source: Hairer
  /// and Wanner, Solving Ordinary Differential Equations II, 1996, equation IV.2.10.
  double stiffness(const Tolerance<Vector>& tolerance) {
    error_ = k7_ - k6_;
    const double change = in_tolerances(error_, before_, next_, tolerance);
    error_ = next_ - stage_;
    const double distance = in_tolerances(error_, before_, next_, tolerance);
    return distance > 0 ? h_ * change / distance : 0;
  }

  /// The state at a share of the last step, [0, 1].
  void interpolate(double share, Vector& x) const {
    const double rest = 1 - share;
    const auto difference = next_ - before_;
    const auto start = h_ * k1_ - difference;
    const auto end = difference - h_ * k7_ - start;
    const auto fifth = h_ * ((-12715105075.0 / 11282082432) * k1_ + (87487479700.0 / 32700410799) * k3_ -
                             (10690763975.0 / 1880347072) * k4_ + (701980252875.0 / 199316789632) * k5_ -
                             (1453857185.0 / 822651844) * k6_ + (69997945.0 / 29380423) * k7_);
    x = before_ + share * (difference + rest * (start + share * (end + rest * fifth)));
  }

 private:
  Vector k1_, k2_, k3_, k4_, k5_, k6_, k7_, stage_, error_, before_, next_;
  double h_ = 0;
  bool taken_ = false;
};

}  // namespace nadir::sim
