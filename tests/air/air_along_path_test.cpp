#include "nadir/sim/air_along_path.h"

#include <gtest/gtest.h>

#include <cmath>

namespace nadir::sim {
namespace {
using Eigen::Vector3d;

const geodesy::Geodetic origin = geodesy::Geodetic::degrees(38.1, -0.76, 100);
const geodesy::Pose<geodesy::frame::Ecef, geodesy::frame::Ned> ecef_from_ned = geodesy::ecef_from_ned(origin);
const Environment environment = Environment::flat(origin);

/// A vehicle that moves evenly over a flat Earth, and its air.
class EvenFlight {
 public:
  EvenFlight(AirParts parts, const Vector3d& start_ned, const Vector3d& velocity_ned)
      : position_(start_ned), velocity_(velocity_ned), air_(start(std::move(parts), start_ned)) {}

  /// To the sample after so many.
  void fly(int samples) {
    for (int k = 0; k < samples; ++k) {
      const auto done = air_.advance(environment, {ecef_from_ned * geodesy::Point<geodesy::frame::Ned>{position_},
                                                   ecef_from_ned * geodesy::Direction<geodesy::frame::Ned>{velocity_}});
      EXPECT_TRUE(done) << (done ? "" : done.error().message);
      position_ += 0.01 * velocity_;
    }
  }
  const AirOverTime& air() const { return air_.air(); }

 private:
  static AirAlongPath start(AirParts parts, const Vector3d& ned) {
    parts.height_above_ground_m = [](const geodesy::Point<geodesy::frame::Ecef>& place) {
      return -(ecef_from_ned.inverse() * place).xyz.z();
    };
    return AirAlongPath::start(std::move(parts), ecef_from_ned * geodesy::Point<geodesy::frame::Ned>{ned}, {1, 0, 0},
                               25)
        .value();
  }
  Vector3d position_, velocity_;
  AirAlongPath air_;
};

AirParts steady(const Vector3d& wind_ned, const Shear& shear = {}) {
  AirParts parts;
  parts.sources.push_back(std::make_unique<SteadyWind>(wind_ned, shear));
  return parts;
}

TEST(AirAlongAPath, AddsItsSourcesUp) {
  AirParts parts = steady({1, 2, 3});
  parts.sources.push_back(std::make_unique<SteadyWind>(Vector3d(10, -5, 0.5), Shear{}));
  EvenFlight flight(std::move(parts), {0, 0, -50}, {25, 0, 0});
  EXPECT_EQ(flight.air().at(0).velocity_ned_mps, Vector3d(11, -3, 3.5));
  flight.fly(10);
  EXPECT_EQ(flight.air().at(0.095).velocity_ned_mps, Vector3d(11, -3, 3.5));
  EXPECT_EQ(flight.air().at(0.095).rates_ned_radps, Vector3d(0, 0, 0));
}

TEST(AirAlongAPath, ShearIsThatOfTheHeightAtEachMoment) {
  // Climbing at 5 m/s from 40 m, wind as the root of height: linear between samples 5 cm apart errs by h^2 / 8 times
  // the curvature, 4e-7 of the wind.
  EvenFlight flight(steady({8, 0, 0}, {.law = Shear::Law::Power, .exponent = 0.5, .top_m = 1000}), {0, 0, -40},
                    {25, 0, -5});
  flight.fly(100);
  for (const double t : {0.990, 0.9937, 1.0})
    EXPECT_NEAR(flight.air().at(t).velocity_ned_mps.x(), 8 * std::sqrt((40 + 5 * t) / 10), 8 * 4e-7) << t;
}

TEST(AirAlongAPath, AGustIsMetAtItsTimeAndLastsForItsLengthThroughTheAir) {
  // Eastwards over ground at 20 m/s against 10 m/s of wind: 30 m/s through the air. A gradient of 12 m passes in 0.4 s.
  AirParts parts = steady({0, -10, 0});
  parts.gusts.push_back({.start_s = 0.504, .speed_mps = 6, .gradient_m = 12, .towards = Gust::Towards::Right});
  EvenFlight flight(std::move(parts), {0, 0, -500}, {0, 20, 0});
  double peak = 0;
  for (int k = 1; k <= 200; ++k) {
    flight.fly(1);
    const double t = 0.01 * k;
    const Vector3d air = flight.air().at(t).velocity_ned_mps;
    EXPECT_NEAR(air.y(), -10, 1e-12) << "nothing along the way";
    EXPECT_EQ(air.z(), 0);
    const double into_s = t - 0.504;
    const double expected = into_s <= 0 || into_s >= 0.8 ? 0 : 3 * (1 - std::cos(M_PI * into_s / 0.4));
    EXPECT_NEAR(air.x(), -expected, 1e-9) << "right of east is south, at " << t;
    peak = std::max(peak, -air.x());
  }
  EXPECT_GT(peak, 5.99);
}

TEST(AirAlongAPath, AGustUpIsUp) {
  AirParts parts = steady({0, 0, 0});
  parts.gusts.push_back({.start_s = 0, .speed_mps = 6, .gradient_m = 5, .shape = Gust::Shape::Step});
  EvenFlight flight(std::move(parts), {0, 0, -500}, {25, 0, 0});
  flight.fly(100);
  EXPECT_NEAR(flight.air().end().velocity_ned_mps.z(), -6, 1e-12);
}

TEST(AirAlongAPath, AGustIsMetByAVehicleThatHoversInStillAirToo) {
  AirParts parts = steady({0, 0, 0});
  parts.gusts.push_back({.start_s = 0.1, .speed_mps = 4, .gradient_m = 1, .shape = Gust::Shape::Step});
  EvenFlight flight(std::move(parts), {0, 0, -20}, {0, 0, 0});
  flight.fly(111);
  EXPECT_NEAR(flight.air().end().velocity_ned_mps.z(), -4, 1e-12) << "at 1 m/s";
}

TEST(AirAlongAPath, TurbulenceTurnsWithTheWayThroughTheAir) {
  const auto flown = [](const Vector3d& velocity_ned) {
    AirParts parts = steady({0, 0, 0});
    parts.turbulence = Turbulence(15, 3, RandomStream(1, "p"));
    EvenFlight flight(std::move(parts), {0, 0, -200}, velocity_ned);
    flight.fly(50);
    return flight.air().end();
  };
  const AirMotion north = flown({25, 0, 0}), east = flown({0, 25, 0});
  for (const auto& [n, e] : {std::pair(north.velocity_ned_mps, east.velocity_ned_mps),
                             std::pair(north.rates_ned_radps, east.rates_ned_radps)}) {
    EXPECT_GT(n.head<2>().norm(), 1e-4);
    EXPECT_NEAR(e.y(), n.x(), 1e-12) << "forward is east";
    EXPECT_NEAR(e.x(), -n.y(), 1e-12) << "right is south";
    EXPECT_NEAR(e.z(), n.z(), 1e-12);
  }
}

TEST(AirAlongAPath, ChangesEvenlyBetweenSamples) {
  AirParts parts = steady({0, 0, 0});
  parts.turbulence = Turbulence(15, 3, RandomStream(1, "p"));
  EvenFlight flight(std::move(parts), {0, 0, -200}, {25, 0, 0});
  flight.fly(7);
  const Vector3d a = flight.air().at(0.06).velocity_ned_mps;
  const Vector3d middle = flight.air().at(0.065).velocity_ned_mps, b = flight.air().at(0.07).velocity_ned_mps;
  EXPECT_LT((middle - (a + b) / 2).norm(), 1e-12);
  EXPECT_GT((b - a).norm(), 1e-3);
  flight.fly(1);
  EXPECT_EQ(flight.air().at(0.07).velocity_ned_mps, b) << "the next stretch begins where this one ends";
}

}  // namespace
}  // namespace nadir::sim
