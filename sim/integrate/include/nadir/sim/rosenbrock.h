#pragma once

#include <Eigen/LU>

#include "nadir/sim/derivative.h"
#include "nadir/sim/step_control.h"

namespace nadir::sim {

/// Rosenbrock method of order 4 with an estimate of order 3, for stiff motion: L-stable and stiffly accurate, so that
/// parts that settle within a step are settled after it. A step takes six evaluations, a Jacobian (given by the
/// derivative, or by differences), one factorisation and six solutions, and iterates nothing; a derivative that depends
/// on time takes one evaluation more. Source: RODAS of Hairer and Wanner, Solving Ordinary Differential Equations II,
/// 1996, section IV.10. For `Adaptive`.
template <class V>
class Rosenbrock {
 public:
  using Vector = V;
  static constexpr const char* name = "rosenbrock";
  static constexpr const char* advice = "a looser tolerance takes fewer";
  static constexpr int error_order = 4;

  /// `like`: any vector of the size that is to come.
  explicit Rosenbrock(const Vector& like)
      : slopes_(MatrixOf<Vector>::Zero(like.size(), like.size())),
        matrix_(slopes_),
        factors_(MatrixOf<Vector>::Identity(like.size(), like.size())) {
    for (Vector* v :
         {&u1_, &u2_, &u3_, &u4_, &u5_, &u6_, &change_, &slope_, &stage_, &there_, &right_, &before_, &next_})
      *v = Vector::Zero(like.size());
  }

  template <class F>
  void start(const F& f, double t_s, const Vector& x, Work& work) {
    evaluate(f, t_s, x, change_, work);
    have_change_ = true;
    have_slopes_ = false;
  }

  /// Estimated error of the step, in tolerances.
  template <class F>
  double attempt(const F& f, double t_s, const Vector& x, double h, const Tolerance<Vector>& tolerance, Work& work) {
    before_ = x;
    if (!have_change_) evaluate(f, t_s, x, change_, work);
    if (!have_slopes_) {  // a step that is tried again keeps them
      jacobian(f, t_s, x, change_, slopes_, stage_, there_, work);
      if constexpr (Autonomous<F>) {
        slope_.setZero();
      } else {
        const double later_s = t_s + std::min(h, difference_distance(t_s));
        evaluate(f, later_s, x, there_, work);
        slope_ = (there_ - change_) / (later_s - t_s);
      }
    }
    have_change_ = have_slopes_ = true;

    matrix_ = -slopes_;
    matrix_.diagonal().array() += 1 / (gamma * h);
    factors_.compute(matrix_);
    ++work.factorisations;

    right_ = change_ + (0.25 * h) * slope_;
    solve(u1_, work);
    stage_ = x + 1.544 * u1_;
    evaluate(f, t_s + 0.386 * h, stage_, there_, work);
    right_ = there_ + (-5.6688 / h) * u1_ + (-0.1043 * h) * slope_;
    solve(u2_, work);
    stage_ = x + 0.9466785280815826 * u1_ + 0.2557011698983284 * u2_;
    evaluate(f, t_s + 0.21 * h, stage_, there_, work);
    right_ = there_ + (1 / h) * (-2.430093356833875 * u1_ - 0.2063599157091915 * u2_) + (0.1035 * h) * slope_;
    solve(u3_, work);
    stage_ = x + 3.314825187068521 * u1_ + 2.896124015972201 * u2_ + 0.9986419139977817 * u3_;
    evaluate(f, t_s + 0.63 * h, stage_, there_, work);
    right_ = there_ + (1 / h) * (-0.1073529058151375 * u1_ - 9.594562251023355 * u2_ - 20.47028614809616 * u3_) +
             (-0.03620000000000023 * h) * slope_;
    solve(u4_, work);
    stage_ = x + 1.221224509226641 * u1_ + 6.019134481288629 * u2_ + 12.53708332932087 * u3_ - 0.6878860361058950 * u4_;
    evaluate(f, t_s + h, stage_, there_, work);
    right_ = there_ + (1 / h) * (7.496443313967647 * u1_ - 10.24680431464352 * u2_ - 33.99990352819905 * u3_ +
                                 11.70890893206160 * u4_);
    solve(u5_, work);
    stage_ += u5_;
    evaluate(f, t_s + h, stage_, there_, work);
    right_ = there_ + (1 / h) * (8.083246795921522 * u1_ - 7.981132988064893 * u2_ - 31.52159432874371 * u3_ +
                                 16.31930543123136 * u4_ - 6.058818238834054 * u5_);
    solve(u6_, work);
    next_ = stage_ + u6_;
    return in_tolerances(u6_, x, next_, tolerance);
  }

  void accept() { have_change_ = have_slopes_ = false; }
  const Vector& next() const { return next_; }
  const Vector& derivative() const { return change_; }

  /// The state at a share of the last step, [0, 1].
  void interpolate(double share, Vector& x) const {
    const double rest = 1 - share;
    const auto second = 10.12623508344586 * u1_ - 7.487995877610167 * u2_ - 34.80091861555747 * u3_ -
                        7.992771707568823 * u4_ + 1.025137723295662 * u5_;
    const auto third = -0.6762803392801253 * u1_ + 6.087714651680015 * u2_ + 16.43084320892478 * u3_ +
                       24.76722511418386 * u4_ - 6.594389125716872 * u5_;
    x = rest * before_ + share * (next_ + rest * (second + share * third));
  }

 private:
  void solve(Vector& u, Work& work) {
    u = factors_.solve(right_);
    ++work.solves;
  }

  static constexpr double gamma = 0.25;
  Vector u1_, u2_, u3_, u4_, u5_, u6_, change_, slope_, stage_, there_, right_, before_, next_;
  MatrixOf<Vector> slopes_, matrix_;
  Eigen::PartialPivLU<MatrixOf<Vector>> factors_;
  bool have_change_ = false, have_slopes_ = false;
};

}  // namespace nadir::sim
