#include "nadir/sim/flight.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "nadir/sim/flown_fixed_wing.h"
#include "nadir/sim/plan_motion.h"
#include "vehicle/aerosonde.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;
using geodesy::Geodetic;
using Method = Scheme::Method;

const Geodetic place = Geodetic::degrees(38.1, -0.76, 3000);
const Environment earth = Environment::wgs84();
constexpr std::int64_t second_ns = 1'000'000'000;

/// Around a square in light turbulence and wind.
Result<Flight> square(const Scheme& scheme, double turbulence_mps = 7) {
  const geodesy::LocalFrame scene(place);
  AirParts parts;
  parts.height_above_ground_m = [](const geodesy::Point<geodesy::frame::Ecef>& p) {
    return geodesy::geodetic_from_ecef(p).height_m;
  };
  parts.sources.push_back(std::make_unique<SteadyWind>(Vector3d(3, -6, 0), Shear{}));
  if (turbulence_mps > 0) parts.turbulence = Turbulence(turbulence_mps, 2.9, RandomStream(5, "turbulence/p"));
  auto air = AirAlongPath::start(std::move(parts), geodesy::ecef_from_geodetic(place), {1, 0, 0}, 25).value();
  const MissionItem corners[] = {Waypoint{400, 0, 0}, Waypoint{400, 400, 20}, Waypoint{0, 400, 0}, Waypoint{0, 5, 0}};
  auto vehicle = fly_fixed_wing({.vehicle = aerosonde(),
                                 .environment = earth,
                                 .scene = scene,
                                 .start = place,
                                 .wind_ned_mps = air.air().end().velocity_ned_mps,
                                 .mission = Mission::create({0, 0, 0}, corners, 150, AfterMission::Repeat).value(),
                                 .scheme = scheme});
  if (!vehicle) return fail(vehicle);
  return Flight(earth, std::move(air), std::move(*vehicle));
}

/// Where it is at the end of each period.
std::vector<BodyState> flown(const Scheme& scheme, std::int64_t seconds) {
  Flight flight = square(scheme).value();
  std::vector<BodyState> states;
  while (flight.time_ns() < seconds * second_ns) {
    EXPECT_TRUE(flight.fly(flight.time_ns() + Flight::period_ns));
    states.push_back(flight.vehicle().body());
  }
  return states;
}

/// Greatest distance of places, and of what lies a kilometre away along attitudes.
double apart_m(const std::vector<BodyState>& a, const std::vector<BodyState>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    worst = std::max({worst, (a[i].position.xyz - b[i].position.xyz).norm(),
                      1000 * a[i].ecef_from_body.quaternion.angularDistance(b[i].ecef_from_body.quaternion)});
  return worst;
}

TEST(Flight, LookingWithinPeriodsChangesNothingAndAgreesWithTheFlight) {
  const Scheme scheme{.method = Method::Rk4, .steps = 4};
  Flight seen = square(scheme).value(), alone = square(scheme).value();
  for (int i = 0; i < 500; ++i) {
    ASSERT_TRUE(seen.fly(seen.time_ns() + Flight::period_ns));
    for (const std::int64_t before : {9'999'999, 5'000'000, 1'234'567, 1}) {
      const FlightState within = seen.at(seen.time_ns() - before).value();
      // Straight back from the end: an acceleration of 3 g leaves a t^2 / 2
      const BodyState& body = seen.vehicle().body();
      const double t = static_cast<double>(before) * 1e-9;
      EXPECT_LT((within.body.position.xyz + t * body.velocity.xyz - body.position.xyz).norm(), 15 * t * t + 4e-9);
    }
    ASSERT_TRUE(alone.fly(alone.time_ns() + Flight::period_ns));
  }
  const BodyVector a = to_vector(seen.vehicle().body()), b = to_vector(alone.vehicle().body());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), sizeof(double) * 13), 0);
}

TEST(Flight, WhatLooksWithinAPeriodMeetsItsEnd) {
  Flight flight = square({.method = Method::DormandPrince}).value();
  ASSERT_TRUE(flight.fly(second_ns));
  const FlightState last = flight.at(second_ns - 1).value(), end = flight.at(second_ns).value();
  EXPECT_LT((last.body.position.xyz - end.body.position.xyz).norm(), 1e-6) << "25 nm of flight, and the steps' error";
  EXPECT_EQ(end.data.channels.size(), flight.vehicle().channels().size());
  EXPECT_NEAR(end.data.specific_force_mps2.z(), -9.8, 6);
}

TEST(PlanMotion, WhatItChoosesKeepsToItsTolerance) {
  // Against another method than the plan's reference, to past the trial: the loop that is closed holds errors down.
  const auto exact = flown({.method = Method::Rk4, .steps = 64}, 40);
  double cost_before = 0;
  for (const double tolerance_m : {1.0, 1e-2, 1e-4, 1e-6}) {
    const auto plan = plan_motion([](const Scheme& s) { return square(s); }, tolerance_m, 20 * second_ns);
    ASSERT_TRUE(plan) << plan.error().message;
    EXPECT_FALSE(plan->stiff) << plan->why;
    EXPECT_EQ(plan->chosen.work.jacobians, 0);
    // Rounding of attitudes and of ECEF, gathered over the flight, leaves micrometres
    EXPECT_LT(apart_m(flown(plan->scheme, 40), exact), 1.5 * tolerance_m + 4e-6) << plan->why;
    EXPECT_GE(plan->chosen.cost, cost_before) << "accuracy costs";
    cost_before = plan->chosen.cost;
    for (const Candidate& one : plan->tried) {
      if (one.meets()) {
        EXPECT_GE(one.cost, plan->chosen.cost) << to_string(one.scheme);
      }
    }
  }
}

TEST(PlanMotion, AMotionThatNoSchemeFliesIsSaid) {
  const auto plan = plan_motion([](const Scheme&) -> Result<Flight> { return fail(Error::Kind::NotFound, "no trim"); },
                                1e-3, second_ns);
  ASSERT_FALSE(plan);
  EXPECT_NE(plan.error().message.find("no trim"), std::string::npos);
}

}  // namespace
}  // namespace nadir::sim
