#include "breaking.h"

#include <fmt/format.h>

#include <limits>

#include "fly.h"

namespace nadir::bench {
namespace {

using sim::Scheme;
using One = Motion<1>::Vector;

/// A motion of one component from 1, an interval of `end_s`.
Motion<1> of_one(double end_s, const Motion<1>::Derivative& f) {
  return {.start = One(1),
          .interval_s = end_s,
          .intervals = 1,
          .derivative_of = [=](int) { return f; },
          .counted = One(1),
          .one = One(1)};
}

/// x' = -rate (x - 1), from 0 off by 1e-3, a second long.
Motion<1> lag(double rate) {
  Motion<1> motion = of_one(1, [=](double, const One& x) { return One(-rate * (x[0] - 1)); });
  motion.start[0] += 1e-3;
  return motion;
}

/// x'' = -(300/s)^2 x, two seconds long.
Motion<2> spring() {
  return {.start = {1, 0},
          .interval_s = 2,
          .intervals = 1,
          .derivative_of =
              [](int) {
                return [](double, const Eigen::Vector2d& x) -> Eigen::Vector2d { return {x[1], -9e4 * x[0]}; };
              },
          .counted = {1, 0},
          .one = {1, 300}};
}

/// The longest of the steps end/n, n = 1.02^k, with which the motion stays within twice its start and `bound`.
template <int n>
double longest_step(const Motion<n>& motion, Scheme::Method method, double shortest_s) {
  double longest = 0;
  int last = 0;
  // From short to long: the first that grows ends the search
  for (double steps = motion.interval_s / shortest_s; steps >= 1; steps /= 1.02) {
    const int count = static_cast<int>(steps);
    if (count == last) continue;
    last = count;
    const auto flown = fly(motion, {.method = method, .steps = count}, 1);
    if (!flown || !(flown->x.cwiseQuotient(motion.one).norm() < 2)) break;
    longest = motion.interval_s / count;
  }
  return longest;
}

template <int n>
Breaking limit_of(const std::string& of, const Motion<n>& motion, double rate, Scheme::Method method, double theory) {
  return {fmt::format("{}, {}", name_of(method), of),
          theory > 0
              ? fmt::format("stable up to {:.4g} ms: {:.4g} over a rate of {:g}/s", 1e3 * theory / rate, theory, rate)
              : "grows at any step",
          [=]() -> BreakingOutcome {
            const double shortest_s = (theory > 0 ? 0.3 * theory : 0.3) / rate;
            const double found = longest_step(motion, method, shortest_s);
            if (theory == 0) return {found == 0, found == 0 ? "grows" : fmt::format("holds at {:.4g} ms", 1e3 * found)};
            return {std::abs(found * rate / theory - 1) < 0.03,
                    fmt::format("holds at {:.4g} ms, grows at 2 % more", 1e3 * found)};
          }};
}

template <int n>
Breaking adaptive(const std::string& name, const std::string& expected, const Motion<n>& motion, Scheme::Method method,
                  double tolerance, const std::function<BreakingOutcome(const Result<Flown<n>>&)>& judge) {
  return {fmt::format("{}, {}", name_of(method), name), expected,
          [=] { return judge(fly(motion, {.method = method}, tolerance, {.most_steps = 20'000})); }};
}

/// It ends by itself, says so with these words, and never with a number that is none.
std::function<BreakingOutcome(const Result<Flown<1>>&)> says(const std::string& words) {
  return [=](const Result<Flown<1>>& flown) -> BreakingOutcome {
    if (flown) return {false, fmt::format("arrives at {}", flown->x[0])};
    return {flown.error().message.find(words) != std::string::npos, flown.error().message};
  };
}

/// It arrives near `x`, within `most` evaluations.
std::function<BreakingOutcome(const Result<Flown<1>>&)> arrives(double x, double within, std::int64_t most) {
  return [=](const Result<Flown<1>>& flown) -> BreakingOutcome {
    if (!flown) return {false, flown.error().message};
    return {std::abs(flown->x[0] - x) <= within && flown->work.evaluations <= most,
            fmt::format("off by {:.2g} after {} evaluations", std::abs(flown->x[0] - x), flown->work.evaluations)};
  };
}

}  // namespace

std::vector<Breaking> breaking_cases() {
  using Method = Scheme::Method;
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<Breaking> all;
  // A step of each, with z = rate dt: 1 - z, 1 - z + z^2/2, ..., to z^4/24. On the imaginary axis |.| > 1 for all but
  // the last; it takes 300 turns to show by a factor of two where z is 0.3.
  for (const auto& [method, real, imaginary] :
       {std::tuple{Method::Euler, 2.0, 0.0}, std::tuple{Method::Midpoint, 2.0, 0.0}, std::tuple{Method::Heun, 2.0, 0.0},
        std::tuple{Method::Rk4, 2.785294, 2.828427}}) {
    all.push_back(limit_of("lag of 1 ms", lag(1000), 1000, method, real));
    all.push_back(limit_of("lag of 0.2 ms", lag(5000), 5000, method, real));
    all.push_back(limit_of("spring of 300 rad/s", spring(), 300, method, imaginary));
  }

  const auto fast = [](double rate) { return lag(rate); };
  all.push_back(adaptive<1>("lag of 10 us", "arrives, limited by stability: 30,000 steps", fast(1e5),
                            Method::DormandPrince, 1e-4, says("more steps than are allowed")));
  for (const double rate : {1e5, 1e9, 1e12})
    all.push_back(adaptive<1>(fmt::format("lag of {:g} s", 1 / rate), "arrives, whatever the rate", fast(rate),
                              Method::Rosenbrock, 1e-4, arrives(1, 1e-3, 500)));
  for (const Method method : {Method::DormandPrince, Method::Rosenbrock}) {
    all.push_back(adaptive<1>("x' = x^2", "ends near t = 1 and says so",
                              of_one(2, [](double, const One& x) { return One(x[0] * x[0]); }), method, 1e-6,
                              says("t = ")));
    all.push_back(adaptive<1>("not a number from 0.5 s on", "ends near t = 0.5 and says so",
                              of_one(1, [](double t, const One&) { return One(t > 0.5 ? nan : 1.0); }), method, 1e-6,
                              says("diverges")));
    all.push_back(adaptive<1>("a jump at 1/3 s", "passes, within 100 tolerances",
                              of_one(1, [](double t, const One&) { return One(t < 1.0 / 3 ? 0.0 : 1.0); }), method,
                              1e-6, arrives(1 + 2.0 / 3, 1e-4, 2000)));
    all.push_back(adaptive<1>("at rest", "passes in a few steps",
                              of_one(1e6, [](double, const One&) { return One(0); }), method, 1e-6,
                              arrives(1, 0, 200)));
  }
  return all;
}

}  // namespace nadir::bench
