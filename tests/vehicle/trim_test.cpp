#include "nadir/sim/trim.h"
#include "nadir/base/random.h"
#include "vehicle/aerosonde.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include "vehicle/models.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;
using geodesy::Geodetic;

constexpr double density = 1.2682, gravity = 9.81, pi = std::numbers::pi;
const Geodetic origin = Geodetic::degrees(38.1, -0.76, 0);
const Vector3d still_air = Vector3d::Zero();

FixedWingState fly(FixedWingState state, const Environment& environment, const Controls& controls, double seconds) {
  const FixedWing vehicle = aerosonde();
  for (int i = 0; i < seconds * 400; ++i)
    state = advance(vehicle, environment, state, controls, still_air, i / 400.0, 1.0 / 400).value();
  return state;
}

TEST(Trim, LeavesNoAccelerationInStraightClimbingAndTurningFlight) {
  for (const double airspeed : {15.0, 20.0, 25.0, 30.0})
    for (const double climb : {-0.1, 0.0, 0.03})
      for (const double radius : {0.0, 150.0, -400.0}) {
        const auto t = trim(aerosonde(), {airspeed, climb, radius}, density, gravity);
        ASSERT_TRUE(t) << t.error().message;
        EXPECT_LT(t->residual, 1e-9);
        if (radius != 0) {
          // The course turns at V cos(climb)/R; with the wings' lift across the path, bank is that of the book to first
          // order (the rudder's side force and the climb change it by a few hundredths of a radian).
          EXPECT_NEAR(t->roll_rad, std::atan(airspeed * airspeed * std::cos(climb) / (gravity * radius)), 0.04);
          EXPECT_NEAR(t->rates_radps.norm(), airspeed * std::cos(climb) / std::abs(radius), 1e-12);
        }
      }
}

TEST(Trim, AMinuteOfFlightHoldsHeightAndAirspeed) {
  // Newton leaves 1e-10 m/s^2. The Aerosonde's spiral and phugoid then let errors grow or live on: 60 s of it stay far
  // under a millimetre over the flat Earth.
  const Environment flat = Environment::flat(origin);
  const auto t = trim(aerosonde(), {.airspeed_mps = 25}, flat, origin);
  ASSERT_TRUE(t);
  const FixedWingState end = fly(trimmed_state(*t, flat, origin, 0.3, still_air), flat, t->controls, 60);
  EXPECT_NEAR(flat.at(end.position).height_m, 0, 1e-4);
  EXPECT_NEAR(body_in_air(end, flat, still_air).flow.airspeed_mps, 25, 1e-5);
}

TEST(Trim, OverTheRealEarthAMinuteOfFlightDriftsByWhatCoriolisDoes) {
  const Geodetic place = Geodetic::degrees(38.1, -0.76, 3000);
  const Environment earth = Environment::wgs84();
  const auto t = trim(aerosonde(), {.airspeed_mps = 25}, earth, place);
  ASSERT_TRUE(t) << t.error().message;
  const FixedWingState end = fly(trimmed_state(*t, earth, place, 0.3, still_air), earth, t->controls, 60);
  EXPECT_NEAR(earth.at(end.position).height_m, 3000, 2);
  EXPECT_NEAR(body_in_air(end, earth, still_air).flow.airspeed_mps, 25, 0.05);
}

TEST(Trim, AMinuteOfTurnClosesItsCircle) {
  const Environment flat = Environment::flat(origin);
  const double radius = 150, around_s = 2 * pi * radius / 25;  // 37.7 s
  const auto t = trim(aerosonde(), {.airspeed_mps = 25, .turn_radius_m = radius}, flat, origin);
  ASSERT_TRUE(t) << t.error().message;
  const FixedWingState start = trimmed_state(*t, flat, origin, 0, still_air);
  const auto place = [&](const FixedWingState& s) {
    return (geodesy::ecef_from_ned(origin).inverse() * s.position).xyz;
  };
  const Vector3d half = place(fly(start, flat, t->controls, around_s / 2)),
                 whole = place(fly(start, flat, t->controls, around_s));
  // Times are cut to steps of 2.5 ms, up to 0.0625 m of path.
  EXPECT_NEAR(half.head<2>().norm(), 2 * radius, 0.1);
  EXPECT_GT(half.y(), 0) << "a positive radius turns to the right";
  EXPECT_NEAR(whole.norm(), 0, 0.1);
}

/// The same whichever way it is begun: from anywhere in attitude and controls.
TEST(Trim, OfEveryModelOverItsSpeedsDoesNotDependOnWhereItBegins) {
  for (const std::string_view name : fixed_wing_models()) {
    const FixedWing vehicle = fixed_wing_model(name).value();
    const double slowest = 1.1 * stall_speed_mps(vehicle, density, gravity);
    RandomStream random(1, "guesses");
    int found = 0;
    for (double airspeed = slowest; airspeed < 3 * slowest; airspeed += 0.1 * slowest)
      for (const double climb : {-0.08, 0.0, 0.05})
        for (const double load : {0.0, 1.2, -1.1}) {
          const double turn = load == 0 ? 0 : std::tan(std::acos(1 / std::abs(load)));
          const TrimTarget target{airspeed, climb,
                                  load == 0 ? 0 : std::copysign(airspeed * airspeed / (gravity * turn), load)};
          const auto usual = trim(vehicle, target, density, gravity);
          if (!usual) {
            const std::string& why = usual.error().message;
            EXPECT_TRUE(why.find("throttle") != std::string::npos ||
                        why.find("lift coefficient") != std::string::npos || why.find("deg of") != std::string::npos)
                << name << ": " << why;
          }
          for (std::uint64_t i = 0; i < 5; ++i) {
            const auto a = random.normals(i, 0), b = random.normals(i, 1);
            const TrimGuess guess{a[0], a[1], a[2], {{0.3 * a[3], 0.3 * b[0], 0.3 * b[1]}, 0.5 + 0.5 * b[2]}};
            const auto t = trim(vehicle, target, density, gravity, guess);
            ASSERT_EQ(t.has_value(), usual.has_value())
                << name << " " << (t ? usual.error().message : t.error().message);
            if (!t) continue;
            ++found;
            EXPECT_LT(t->residual, 1e-9);
            EXPECT_LT(t->alpha_rad, greatest_lift(vehicle).alpha_rad);
            EXPECT_NEAR(t->alpha_rad, usual->alpha_rad, 1e-9);
            EXPECT_NEAR(t->roll_rad, usual->roll_rad, 1e-9);
            EXPECT_NEAR(t->controls.throttle, usual->controls.throttle, 1e-9);
            EXPECT_NEAR(t->controls.surfaces.elevator_rad, usual->controls.surfaces.elevator_rad, 1e-9);
          }
        }
    RecordProperty(std::string(name), found);
    EXPECT_GT(found, 200) << name;
  }
}

TEST(Trim, SaysWhyThereIsNone) {
  const auto message = [](const TrimTarget& target) {
    const auto t = trim(aerosonde(), target, density, gravity);
    return t ? std::string("found") : t.error().message;
  };
  EXPECT_NE(message({.airspeed_mps = 25, .climb_angle_rad = 0.5}).find("throttle"), std::string::npos)
      << message({.airspeed_mps = 25, .climb_angle_rad = 0.5});
  EXPECT_NE(message({.airspeed_mps = 0}).find("above zero"), std::string::npos);
  EXPECT_NE(message({.airspeed_mps = -3}).find("above zero"), std::string::npos);
  EXPECT_NE(message({.airspeed_mps = std::nan("")}).find("above zero"), std::string::npos);
  for (const TrimTarget& impossible :
       {TrimTarget{.airspeed_mps = 5}, TrimTarget{.airspeed_mps = 25, .turn_radius_m = 10},
        TrimTarget{.airspeed_mps = 25, .climb_angle_rad = -1.5}})
    EXPECT_NE(message(impossible).find("steady flight at"), std::string::npos) << message(impossible);
  EXPECT_NE(message({.airspeed_mps = 5}).find("lift coefficient of 12.3"), std::string::npos)
      << message({.airspeed_mps = 5});
  EXPECT_NE(message({.airspeed_mps = 25, .climb_angle_rad = -1}).find("too steep"), std::string::npos)
      << message({.airspeed_mps = 25, .climb_angle_rad = -1});
}

}  // namespace
}  // namespace nadir::sim
