// Whole runs in moving air: what vehicles meet, what telemetry tells, and that nothing else of a run changes it.
#include <gtest/gtest.h>

#include <cmath>

#include "sim/flown_run.h"

namespace nadir::sim {
namespace {

class AirRun : public FlownRun {
 protected:
  std::vector<VehicleState> fly(const std::string& vehicles, const std::string& duration_s,
                                const std::string& rate_hz = "100", const std::string& more = "") {
    return execute(vehicles, duration_s, false, more + "record: {telemetry_rate_hz: " + rate_hz + "}\n").states.at("p");
  }
  const std::string straight = "  p: {start: {height: 500 agl, yaw_deg: 90}}\n";
};

TEST_F(AirRun, AWindFromTheWestCarriesAVehicleEast) {
  // Heading east at 25 m/s through the air in 6 m/s from behind.
  air = "air: {wind: {from_deg: 270, speed_mps: 6}}\n";
  const auto states = fly(straight, "2");
  for (const VehicleState& s : states) {
    EXPECT_NEAR((s.flight->wind_ned_mps - Eigen::Vector3d(0, 6, 0)).norm(), 0, 1e-12);
    EXPECT_NEAR(s.flight->velocity_ned_mps.y(), 31, 0.3);
    EXPECT_NEAR(s.flight->airspeed_mps, 25, 0.3);
  }
}

TEST_F(AirRun, ShearTurnsTheWindOfTheGroundIntoThatOfTheHeight) {
  air = "air: {wind: {from_deg: 0, speed_mps: 4}, shear: {law: power, exponent: 0.25, top_m: 160}}\n";
  const auto states = fly("  p: {start: {height: 90 agl, yaw_deg: 90}}\n", "1");
  for (const VehicleState& s : states)
    // Above the plane of the ground to within a metre of 90: 0.3 % of height is 0.07 % of this wind.
    EXPECT_NEAR(s.flight->wind_ned_mps.x() / (-4 * std::pow(9, 0.25)), 1, 2e-3) << "9 times the reference height";
}

TEST_F(AirRun, AGustUpRaisesTheAngleOfAttackAndTheLift) {
  air = "air: {gusts: [{start_s: 1, speed_mps: 3, gradient_m: 5, shape: step, towards: up}]}\n";
  const auto states = fly(straight, "1.2");
  const FlightData &before = *states[100].flight, &in = *states[120].flight;
  EXPECT_EQ(before.wind_ned_mps, Eigen::Vector3d(0, 0, 0));
  EXPECT_NEAR((in.wind_ned_mps - Eigen::Vector3d(0, 0, -3)).norm(), 0, 1e-12) << "met at once, whole after 5 m";
  // w / V = 0.12 rad, of which the vehicle has pitched and climbed off a part in 0.2 s.
  EXPECT_GT(in.alpha_rad - before.alpha_rad, 0.02);
  EXPECT_LT(in.alpha_rad - before.alpha_rad, 0.12);
  EXPECT_LT(in.specific_force_mps2.z(), before.specific_force_mps2.z() - 3) << "up is against body z";
  EXPECT_LT(in.velocity_ned_mps.z(), -0.3) << "it is carried up";
}

TEST_F(AirRun, TurbulenceShakesAVehicleAboutItsPathAndItStaysOnIt) {
  air = "air: {turbulence: {intensity: moderate}}\n";
  const auto states = fly("  p: {start: {height: 500 agl, yaw_deg: 90}}\n", "60", "20");
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double p2 = 0;
  for (const VehicleState& s : states) {
    sum += s.flight->wind_ned_mps.cwiseAbs2();
    p2 += std::pow(s.flight->rates_radps.x(), 2);
    EXPECT_NEAR(s.flight->airspeed_mps, 25, 12);
  }
  const Eigen::Vector3d rms = (sum / static_cast<double>(states.size())).cwiseSqrt();
  const TurbulenceScales scales = turbulence_scales(500, wind_at_20ft_mps(TurbulenceIntensity::Moderate));
  // 60 s at 25 m/s are 3 to 4 scale lengths of 400 m: variances within a factor of 3.
  for (int i = 0; i < 3; ++i) {
    EXPECT_GT(rms[i], scales.sigma_mps[i] / 1.8) << i;
    EXPECT_LT(rms[i], scales.sigma_mps[i] * 1.8) << i;
  }
  EXPECT_GT(std::sqrt(p2 / static_cast<double>(states.size())), 0.01);
}

TEST_F(AirRun, TurbulenceIsTheVehiclesOwnWhoeverElseFliesAndHoweverOftenItIsLookedAt) {
  air = "air: {turbulence: {intensity: severe}, gusts: [{start_s: 0.5, speed_mps: 3, gradient_m: 9, towards: left}]}\n";
  const std::string p = straight, q = "  q: {start: {height: 500 agl, yaw_deg: 90}}\n";
  const auto alone = fly(p, "2"), after_q = fly(q + p, "2"), often = fly(p, "2", "1000"),
             other_seed = fly(p, "2", "100", "seed: 8\n");
  const auto q_states = execute(q, "2", false, "record: {telemetry_rate_hz: 100}\n").states.at("q");
  ASSERT_EQ(often.size(), 10 * (alone.size() - 1) + 1);
  for (std::size_t i = 0; i < alone.size(); ++i) {
    EXPECT_TRUE(same(after_q[i], alone[i])) << i;
    EXPECT_TRUE(same(often[10 * i], alone[i])) << i;
    EXPECT_EQ(often[10 * i].flight->wind_ned_mps, alone[i].flight->wind_ned_mps);
    EXPECT_NE(q_states[i].flight->wind_ned_mps, alone[i].flight->wind_ned_mps) << "streams have vehicles' names";
    EXPECT_NE(other_seed[i].flight->wind_ned_mps, alone[i].flight->wind_ned_mps);
  }
}

TEST_F(AirRun, AMapOfWindIsFeltWhereTheVehicleIs) {
  test::SyntheticMap map;  // wind towards east by latitude, around the scene
  map.width = map.height = 100;
  map.bands = 2;
  map.role = "field";
  map.geotransform = {-0.81, 1e-3, 0, 38.15, 0, -1e-3};
  map.value = [](int, int band, int, int row) { return band == 0 ? 0.1 * (row + 0.5) : -2; };
  test::write_map(map, folder.file("wind.tif"));
  air = "air: {field: {map: wind.tif}}\n";
  for (const VehicleState& s : fly("  p: {start: {height: 500 agl}}\n", "5", "10")) {
    const double row = (38.15 - geodesy::to_degrees(s.place.lat_rad)) / 1e-3;
    EXPECT_NEAR(s.flight->wind_ned_mps.y(), 0.1 * row, 1e-5) << "sampled for the right place";
    EXPECT_NEAR(s.flight->wind_ned_mps.x(), -2, 1e-12);
  }
  air = "air: {field: {map: gone.tif}}\n";
  const auto run = prepare(straight, "1");
  ASSERT_FALSE(run);
  EXPECT_NE(run.error().message.find("vehicle p: air.field: "), std::string::npos) << run.error().message;
  EXPECT_NE(run.error().message.find("gone.tif"), std::string::npos) << run.error().message;
}

TEST_F(AirRun, AHotDayThinsTheAirAndAsksForMoreThrottle) {
  air = "";
  const double standard = fly(straight, "0.01").front().flight->throttle;
  air = "air: {atmosphere: {temperature_offset_k: 30}}\n";
  EXPECT_GT(fly(straight, "0.01").front().flight->throttle, standard);
}

}  // namespace
}  // namespace nadir::sim
