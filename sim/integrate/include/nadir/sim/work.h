#pragma once

#include <cstdint>

namespace nadir::sim {

/// What an integration took, counted: the same on every machine, however busy.
struct Work {
  std::int64_t evaluations = 0;     // of the derivative, those for Jacobians included
  std::int64_t jacobians = 0;       // given or by differences
  std::int64_t factorisations = 0;  // of matrices as wide as the state
  std::int64_t solves = 0;          // with such a factorisation
  std::int64_t steps = 0;           // that were taken
  std::int64_t rejected = 0;        // that erred too much and were tried again shorter
  friend bool operator==(const Work&, const Work&) = default;
  Work& operator+=(const Work& other);
};

/// What work costs, in evaluations of the derivative.
struct CostModel {
  double flops_per_evaluation = 0;  // of the derivative; 0: 20 for each component of the state
  double given_jacobian = 1;        // one that the derivative gives itself
};

/// Evaluations that `work` is worth for a state of `size` components: a factorisation takes 2/3 size^3 operations, a
/// solution 2 size^2.
double cost_of(const Work& work, std::int64_t size, bool gives_jacobian, const CostModel& model);

}  // namespace nadir::sim
