#include "nadir/sim/wind.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nadir/geodesy/geodetic.h"
#include "nadir/sim/gust.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;
using geodesy::to_radians;

TEST(Wind, BlowsAwayFromWhereItComesFrom) {
  const auto close = [](const Vector3d& a, const Vector3d& b) { return (a - b).norm() < 1e-14 * 10; };
  EXPECT_TRUE(close(wind_towards_ned_mps(to_radians(0), 10, 0), {-10, 0, 0})) << "a north wind goes south";
  EXPECT_TRUE(close(wind_towards_ned_mps(to_radians(270), 10, 0), {0, 10, 0})) << "a west wind goes east";
  EXPECT_TRUE(close(wind_towards_ned_mps(to_radians(225), 10, 0), {std::sqrt(50), std::sqrt(50), 0}))
      << "a south-west wind goes north-east";
  EXPECT_TRUE(close(wind_towards_ned_mps(0, 0, 3), {0, 0, -3})) << "up is against down";
}

TEST(Shear, FollowsThePowerLaw) {
  const Shear shear{.law = Shear::Law::Power, .reference_m = 10, .exponent = 0.5, .top_m = 160};
  EXPECT_DOUBLE_EQ(shear.factor(10), 1);
  EXPECT_DOUBLE_EQ(shear.factor(90), 3);
  EXPECT_DOUBLE_EQ(shear.factor(2.5), 0.5);
  EXPECT_DOUBLE_EQ(shear.factor(160), 4);
  EXPECT_DOUBLE_EQ(shear.factor(9000), 4) << "no more above the top";
  EXPECT_EQ(shear.factor(0), 0);
  EXPECT_EQ(shear.factor(-5), 0);
}

TEST(Shear, FollowsTheLogarithmicLaw) {
  // MIL-F-8785C, section 3.7: w20 ln(h / 0.15) / ln(20 / 0.15), in feet; at 100 ft 1.3289 times the wind at 20 ft.
  constexpr double foot_m = 0.3048;
  const Shear shear{
      .law = Shear::Law::Logarithmic, .reference_m = 20 * foot_m, .roughness_m = 0.15 * foot_m, .top_m = 1000 * foot_m};
  EXPECT_NEAR(shear.factor(100 * foot_m), 1.3289, 0.5e-4);
  EXPECT_NEAR(shear.factor(3 * foot_m), 0.6123, 0.5e-4);
  EXPECT_EQ(shear.factor(0.15 * foot_m), 0);
  EXPECT_EQ(shear.factor(-1), 0);
}

TEST(SteadyWindSource, ShearsLevelWindAndNotTheVerticalOne) {
  SteadyWind wind({-4, 8, -1}, {.law = Shear::Law::Power, .exponent = 0.5, .top_m = 1000});
  const auto at = [&](double height_m) { return wind.towards_ned_mps({.height_above_ground_m = height_m}).value(); };
  EXPECT_EQ(at(10), Vector3d(-4, 8, -1));
  EXPECT_EQ(at(40), Vector3d(-8, 16, -1));
  SteadyWind even({-4, 8, -1}, {});
  EXPECT_EQ(even.towards_ned_mps({.height_above_ground_m = 400}).value(), Vector3d(-4, 8, -1));
}

TEST(DiscreteGust, IsOneMinusCosineOverItsGradientLength) {
  const Gust pulse{.speed_mps = 6, .gradient_m = 30, .shape = Gust::Shape::Pulse};
  const Gust step{.speed_mps = 6, .gradient_m = 30, .shape = Gust::Shape::Step};
  for (const Gust* gust : {&pulse, &step}) {
    EXPECT_EQ(gust->speed_at_mps(-1), 0);
    EXPECT_EQ(gust->speed_at_mps(0), 0);
    EXPECT_NEAR(gust->speed_at_mps(10), 1.5, 1e-12) << "(1 - cos 60 degrees) / 2 = 1/4";
    EXPECT_NEAR(gust->speed_at_mps(15), 3, 1e-12);
    EXPECT_NEAR(gust->speed_at_mps(30), 6, 1e-12);
  }
  EXPECT_NEAR(pulse.speed_at_mps(45), 3, 1e-12);
  EXPECT_NEAR(pulse.speed_at_mps(50), 1.5, 1e-12);
  EXPECT_NEAR(pulse.speed_at_mps(59.999), 0, 1e-7);
  EXPECT_EQ(pulse.speed_at_mps(61), 0);
  EXPECT_EQ(step.speed_at_mps(31), 6);
  EXPECT_EQ(step.speed_at_mps(1e6), 6);
}

TEST(DiscreteGust, DirectionsAreOfTheAirAndOpposeInPairs) {
  const auto direction = [](const char* name) { return Gust{.towards = parse_gust_towards(name).value()}.direction(); };
  EXPECT_EQ(direction("forward"), Vector3d(1, 0, 0));
  EXPECT_EQ(direction("right"), Vector3d(0, 1, 0));
  EXPECT_EQ(direction("down"), Vector3d(0, 0, 1));
  EXPECT_EQ(direction("back"), -direction("forward"));
  EXPECT_EQ(direction("left"), -direction("right"));
  EXPECT_EQ(direction("up"), -direction("down"));
  EXPECT_FALSE(parse_gust_towards("north"));
  EXPECT_FALSE(parse_gust_shape("square"));
}

}  // namespace
}  // namespace nadir::sim
