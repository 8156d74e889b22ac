#include "nadir/sim/plan_motion.h"
#include "nadir/base/time.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace nadir::sim {
namespace {

struct Place {
  Eigen::Vector3d position;
  Eigen::Quaterniond attitude;
};

/// Distance in metres: of the positions, or of what lies a kilometre away, whichever is greater.
double apart_m(const Place& a, const Place& b) {
  return std::max((a.position - b.position).norm(), 1000 * a.attitude.angularDistance(b.attitude));
}

/// Where it is at the end of each period.
std::vector<Place> fly(const MakeFlight& make, const Scheme& scheme, const Trial& trial, Candidate& candidate) {
  candidate.scheme = scheme;
  std::vector<Place> places;
  auto flight = make(scheme);
  if (!flight) {
    candidate.fault = flight.error().message;
    return places;
  }
  const auto falls = [&] {
    const auto& events = flight->events();
    return std::any_of(events.begin(), events.end(),
                       [](const FlightEvent& event) { return event.name == FlightEvent::battery_empty; });
  };
  // A crash ends the trial as it will end the flight; how a vehicle tumbles that nobody steers is for no tolerance
  for (int i = 0; i < trial.intervals && candidate.fault.empty() && !flight->ended() && !falls(); ++i) {
    if (auto ok = flight->fly(flight->time_ns() + Flight::period_ns); !ok) candidate.fault = ok.error().message;
    if (flight->ended() && flight->ended()->name == FlightEvent::diverged) candidate.fault = in_words(*flight->ended());
    const BodyState& body = flight->vehicle().body();
    places.push_back({body.position.xyz, body.ecef_from_body.quaternion});
  }
  candidate.work = flight->vehicle().work();
  candidate.cost = cost_of(candidate.work, BodyVector::RowsAtCompileTime, false, trial.cost);
  return places;
}

/// Of one implicit step: a Jacobian by differences, six stages, one factorisation.
double least_implicit_cost(const CostModel& model) {
  constexpr std::int64_t size = BodyVector::RowsAtCompileTime;
  return cost_of({.evaluations = size + 7, .jacobians = 1, .factorisations = 1, .solves = 6}, size, false, model);
}

}  // namespace

Result<Plan> plan_motion(const MakeFlight& make, double tolerance_m, std::int64_t trial_ns) {
  using Method = Scheme::Method;
  const Trial trial{.interval_s = seconds_from_ns(Flight::period_ns),
                    .intervals = static_cast<int>(std::max<std::int64_t>(trial_ns / Flight::period_ns, 1)),
                    .most_steps = 64};
  Plan plan;
  Candidate loose, reference_run;
  fly(make, {.method = Method::DormandPrince}, trial, loose);
  plan.stiff = !loose.fault.empty() || loose.cost > trial.intervals * least_implicit_cost(trial.cost);

  std::vector<Place> reference = fly(make, {.method = Method::DormandPrince, .tightness = 1e-4}, trial, reference_run);
  if (!reference_run.fault.empty()) {
    plan.stiff = true;
    reference_run = {};
    reference = fly(make, {.method = Method::Rosenbrock, .tightness = 1e-4}, trial, reference_run);
    if (reference_run.fault.starts_with(FlightEvent::diverged)) {  // so will the flight, and say when and how
      plan.scheme = {.method = Method::Rk4, .steps = 4};
      plan.why = "the flight diverges, however finely it is stepped";
      return plan;
    }
    if (!reference_run.fault.empty())
      return fail(Error::Kind::Unsupported, "no scheme flies this motion: " + reference_run.fault);
  }
  const std::string because =
      fmt::format("the cheapest over the first {:g} s within {:g} m{}", trial.intervals * trial.interval_s, tolerance_m,
                  plan.stiff ? "; stiff, so an implicit one was tried" : "; not stiff, so no implicit one was tried");
  return cheapest_scheme(std::move(plan), trial, because, [&](const Scheme& scheme) {
    Candidate candidate;
    const std::vector<Place> places = fly(make, scheme, trial, candidate);
    if (candidate.fault.empty()) {
      candidate.error = 0;
      for (std::size_t i = 0; i < std::min(places.size(), reference.size()); ++i)
        candidate.error = std::max(*candidate.error, apart_m(places[i], reference[i]) / tolerance_m);
    }
    return candidate;
  });
}

}  // namespace nadir::sim
