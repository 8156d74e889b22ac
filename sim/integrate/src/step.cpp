#include "nadir/sim/step.h"

#include <fmt/format.h>

#include <cmath>

namespace nadir::sim {

int stages_of(ExplicitMethod method) {
  switch (method) {
    case ExplicitMethod::Euler:
      return 1;
    case ExplicitMethod::Midpoint:
    case ExplicitMethod::Heun:
      return 2;
    case ExplicitMethod::Rk4:
      break;
  }
  return 4;
}

Error not_finite(const Eigen::Ref<const Eigen::VectorXd>& x, double t_s) {
  Eigen::Index i = 0;
  while (i + 1 < x.size() && std::isfinite(x[i])) ++i;
  return {Error::Kind::Unsupported,
          fmt::format(
              "the motion diverged at t = {} s: component {} of the state is no finite number; a shorter step, gentler "
              "controls or gains are needed",
              t_s, i)};
}

}  // namespace nadir::sim
