#include "nadir/sim/flown_multirotor.h"
#include "nadir/base/time.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "nadir/sim/flight.h"
#include "nadir/sim/multirotor_ground.h"
#include "nadir/sim/plan_motion.h"
#include "vehicle/models.h"
#include "vehicle/slope.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;
using geodesy::Geodetic;
using Method = Scheme::Method;

const Geodetic place = Geodetic::degrees(38.1, -0.76, 500);
const geodesy::LocalFrame scene(place);
const Environment earth = Environment::wgs84();
constexpr std::int64_t second_ns = 1'000'000'000;

double above_ground_m(const geodesy::Point<geodesy::frame::Ecef>& p) { return (scene.enu_from_ecef() * p).xyz.z(); }

struct Options {
  Multirotor vehicle = quadrotor();
  MultirotorMission mission;
  Vector3d wind_ned_mps = Vector3d(2, -3, 0);
  double turbulence_mps = 0, charge_share = 1;
  bool integrate_currents = false;
  std::shared_ptr<const Ground> ground = std::make_shared<PlaneGround>(scene, 0);
  Scheme scheme{.method = Method::Rk4, .steps = 4};
};

Result<Flight> flight_of(const Options& options) {
  AirParts parts;
  parts.height_above_ground_m = above_ground_m;
  parts.sources.push_back(std::make_unique<SteadyWind>(options.wind_ned_mps, Shear{}));
  if (options.turbulence_mps > 0)
    parts.turbulence = Turbulence(options.turbulence_mps, 0.9, RandomStream(5, "turbulence/c"));
  const Waypoint& start = options.mission.start;
  const auto at =
      scene.ecef_from_enu() * geodesy::Point<geodesy::frame::Enu>{{start.east_m, start.north_m, start.height_m}};
  auto air = AirAlongPath::start(std::move(parts), at, {1, 0, 0}, 0).value();
  auto vehicle = fly_multirotor({.vehicle = options.vehicle,
                                 .environment = earth,
                                 .scene = scene,
                                 .mission = options.mission,
                                 .wind_ned_mps = options.wind_ned_mps,
                                 .charge_share = options.charge_share,
                                 .ground = options.ground,
                                 .integrate_currents = options.integrate_currents,
                                 .scheme = options.scheme});
  if (!vehicle) return fail(vehicle);
  return Flight(earth, std::move(air), std::move(*vehicle));
}

/// Up from the ground, to a waypoint, and down.
MultirotorMission hop() {
  MultirotorMission mission;
  mission.start = {0, 0, 0.15};
  mission.from_ground = mission.land = true;
  mission.waypoints = {{.at = {20, 10, 12}, .hold_s = 2, .speed_mps = {}, .yaw_rad = 1.0}};
  return mission;
}

TEST(FlownMultirotor, TakesOffFliesAndTouchesDownAsSlowlyAsAsked) {
  for (const Multirotor& vehicle : {quadrotor(), pulsed_quadrotor(), lumped_multirotor()}) {
    Options options{.vehicle = vehicle, .mission = hop()};
    options.mission.landing_mps = 0.4;
    Flight flight = flight_of(options).value();
    double highest_m = 0, sink_mps = -1;
    while (flight.time_ns() < 90 * second_ns && flight.events().size() < 2) {
      sink_mps = flight.at(flight.time_ns()).value().data.velocity_ned_mps.z();
      ASSERT_TRUE(flight.fly(flight.time_ns() + Flight::period_ns));
      highest_m = std::max(highest_m, above_ground_m(flight.vehicle().body().position));
    }
    ASSERT_EQ(flight.events().size(), 2u);
    EXPECT_EQ(flight.events()[0].name, "lift-off");
    EXPECT_LT(flight.events()[0].time_ns, 2 * second_ns);
    EXPECT_EQ(flight.events()[1].name, "touch-down");
    EXPECT_EQ(flight.events()[1].time_ns, flight.time_ns());
    EXPECT_NEAR(highest_m, 12, 1.5);
    EXPECT_NEAR(sink_mps, 0.4, 0.15);
    EXPECT_GT(flight.time_ns(), 20 * second_ns);
    const Vector3d enu = (scene.enu_from_ecef() * flight.vehicle().body().position).xyz;
    EXPECT_NEAR((enu.head<2>() - Eigen::Vector2d(10, 20)).norm(), 0, 1);
    // It stands there with its rotors off, by what its springs give, and feels its weight
    ASSERT_TRUE(flight.fly(flight.time_ns() + 3 * second_ns));
    const FlightState end = flight.at(flight.time_ns()).value();
    EXPECT_EQ(end.data.throttle, 0);
    EXPECT_EQ(end.body.velocity.xyz.norm(), 0);
    EXPECT_NEAR(end.data.specific_force_mps2.norm(), 9.8, 0.05);
    EXPECT_NEAR(above_ground_m(end.body.position), standing_height_m(gear_of(vehicle)) - 0.004, 2e-4);
    EXPECT_EQ(flight.events().size(), 2u);
    const auto channel = [&](const char* name) {
      const auto names = flight.vehicle().channels();
      return end.data.channels[static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin())];
    };
    EXPECT_EQ(channel("legs_on_ground"), 4);
    EXPECT_NEAR(channel("ground_force_n"), 9.8 * vehicle.mass.mass_kg(), 0.5);
  }
}

TEST(FlownMultirotor, LookingWithinPeriodsChangesNothing) {
  Options options{.mission = hop(), .turbulence_mps = 7};
  options.vehicle.battery = lithium_polymer(6, 10, 0.02);
  for (Rotor& rotor : options.vehicle.rotors)
    std::get<ElectricDrive>(rotor.drive).dynamics = {.rotor_inertia_kgm2 = 2e-4, .inductance_h = 2e-4 * 0.042};
  Flight seen = flight_of(options).value(), alone = flight_of(options).value();
  for (int i = 0; i < 1500; ++i) {
    ASSERT_TRUE(seen.fly(seen.time_ns() + Flight::period_ns));
    for (const std::int64_t before : {9'999'999, 1'234'567, 1}) {
      const auto within = seen.at(seen.time_ns() - before);
      ASSERT_TRUE(within);
      EXPECT_EQ(within->data.channels.size(), seen.vehicle().channels().size());
    }
    ASSERT_TRUE(alone.fly(alone.time_ns() + Flight::period_ns));
  }
  const BodyVector a = to_vector(seen.vehicle().body()), b = to_vector(alone.vehicle().body());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), sizeof(double) * 13), 0);
}

TEST(FlownMultirotor, IntegratedCurrentsAgreeWithSettledOnesAndCostMore) {
  Options options;
  options.mission.start = {0, 0, 50};
  options.mission.waypoints = {{.at = {10, 0, 52}, .hold_s = {}, .speed_mps = {}, .yaw_rad = {}}};
  for (Rotor& rotor : options.vehicle.rotors)
    std::get<ElectricDrive>(rotor.drive).dynamics = {.rotor_inertia_kgm2 = 2e-4, .inductance_h = 2e-4 * 0.042};
  options.integrate_currents = true;
  const MakeFlight make = [&](const Scheme& scheme) {
    Options o = options;
    o.scheme = scheme;
    return flight_of(o);
  };
  const auto plan = plan_motion(make, 1e-2, 4 * second_ns);
  ASSERT_TRUE(plan) << plan.error().message;
  RecordProperty("currents_scheme", to_string(plan->scheme));
  Flight exact = make(plan->scheme).value();
  options.integrate_currents = false;
  Flight settled = flight_of(options).value();
  ASSERT_TRUE(exact.fly(4 * second_ns));
  ASSERT_TRUE(settled.fly(4 * second_ns));
  EXPECT_LT((exact.vehicle().body().position.xyz - settled.vehicle().body().position.xyz).norm(), 0.02);
  EXPECT_GT(exact.vehicle().work().evaluations, 3 * settled.vehicle().work().evaluations);
  RecordProperty("currents_evaluations", static_cast<int>(exact.vehicle().work().evaluations));
  RecordProperty("settled_evaluations", static_cast<int>(settled.vehicle().work().evaluations));
}

TEST(FlownMultirotor, AnEmptyBatteryEndsInACrashThatIsSaid) {
  Options options;
  options.mission.start = {0, 0, 30};
  options.vehicle.battery = lithium_polymer(6, 0.5, 0.02);
  options.charge_share = 0.3;
  Flight flight = flight_of(options).value();
  const auto end = flight.fly(120 * second_ns);
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().message.find("crash at "), 0u) << end.error().message;
  EXPECT_NE(end.error().message.find("its battery empty"), std::string::npos) << end.error().message;
  ASSERT_EQ(flight.events().size(), 2u);
  EXPECT_EQ(flight.events()[0].name, "battery empty");
  EXPECT_FALSE(flight.events()[0].ends_flight);
  ASSERT_TRUE(flight.ended());
  EXPECT_EQ(flight.ended()->name, "crash") << "and not that it diverged";
  EXPECT_GT(flight.ended()->time_ns, flight.events()[0].time_ns);
  const FlightState last = flight.at(flight.ended()->time_ns).value();
  EXPECT_TRUE(to_vector(last.body).allFinite());
}

TEST(FlownMultirotor, InTheAirTheGroundChangesNothingAndCostsNothing) {
  Options options;
  options.mission.start = {0, 0, 60};
  options.mission.waypoints = {{.at = {10, 0, 62}, .hold_s = {}, .speed_mps = {}, .yaw_rad = {}}};
  Flight over = flight_of(options).value();
  options.ground = nullptr;
  Flight without = flight_of(options).value();
  ASSERT_TRUE(over.fly(20 * second_ns));
  ASSERT_TRUE(without.fly(20 * second_ns));
  EXPECT_EQ(to_vector(over.vehicle().body()), to_vector(without.vehicle().body()));
  EXPECT_EQ(over.vehicle().work().evaluations, 4 * 4 * 2000);
  EXPECT_EQ(without.vehicle().work().evaluations, 4 * 4 * 2000);
}

/// Up from a slope that falls to the east, and down on it again 8 m to the north, in wind of (2, -3) m/s.
Options slope_hop(double slope_rad, bool from_ground = true) {
  Options options{.mission = hop(), .wind_ned_mps = {2, -3, 0}};
  options.ground = std::make_shared<SlopeEast>(scene, slope_rad);
  options.mission.waypoints = {{.at = {8, 0, 6}, .hold_s = 1, .speed_mps = {}, .yaw_rad = {}}};
  options.mission.from_ground = from_ground;
  if (!from_ground) options.mission.start = {0, 0, 6};
  return options;
}

TEST(FlownMultirotor, TakesOffFromASlopeAndStandsOnItOnFourLegs) {
  Flight flight = flight_of(slope_hop(0.2)).value();
  ASSERT_TRUE(flight.fly(40 * second_ns)) << in_words(*flight.ended());
  ASSERT_EQ(flight.events().size(), 2u);
  EXPECT_EQ(flight.events()[0].name, "lift-off");
  EXPECT_EQ(flight.events()[1].name, "touch-down");
  const BodyState& body = flight.vehicle().body();
  const Vector3d up_enu = scene.enu_from_ecef().rotation * (body.ecef_from_body.quaternion * -Vector3d::UnitZ());
  EXPECT_NEAR(std::acos(up_enu.dot(Vector3d(std::sin(0.2), 0, std::cos(0.2)))), 0, 0.02);
  EXPECT_EQ(body.velocity.xyz.norm(), 0);
}

TEST(FlownMultirotor, ASlopeThatIsTooSteepEndsInACrashThatSaysWhatMetIt) {
  Flight flight = flight_of(slope_hop(0.9, false)).value();
  ASSERT_FALSE(flight.fly(40 * second_ns));
  ASSERT_TRUE(flight.ended());
  EXPECT_EQ(flight.ended()->name, "crash");
  EXPECT_NE(flight.ended()->text.find("the rotor "), std::string::npos) << flight.ended()->text;
  EXPECT_NE(flight.ended()->text.find(" m above the ellipsoid"), std::string::npos) << flight.ended()->text;
}

TEST(FlownMultirotor, FlightsThatTouchTheGroundCanBePlanned) {
  const auto plan = plan_motion(
      [](const Scheme& scheme) {
        Options options = slope_hop(0.2);
        options.scheme = scheme;
        return flight_of(options);
      },
      1e-2, 3 * second_ns);
  EXPECT_TRUE(plan) << plan.error().message;
}

TEST(FlownMultirotor, SaysWhyItCannotFly) {
  const auto message = [](const Options& options) {
    const auto flight = flight_of(options);
    return flight ? std::string("flies") : flight.error().message;
  };
  Options options;
  options.mission.start = {0, 0, 30};
  EXPECT_EQ(message(options), "flies");
  Options storm = options;
  storm.wind_ned_mps = {60, 0, 0};
  EXPECT_NE(message(storm).find("steady flight at"), std::string::npos) << message(storm);
  Options broken = options;
  broken.vehicle.rotors[1].thrust_axis *= 3;
  EXPECT_NE(message(broken).find("rotors.rear right: thrust_axis"), std::string::npos) << message(broken);
  Options heavy = options;
  heavy.vehicle.mass = MassProperties::create(14, {.jxx_kgm2 = 1, .jyy_kgm2 = 1, .jzz_kgm2 = 1}).value();
  EXPECT_NE(message(heavy).find("nothing to steer with"), std::string::npos) << message(heavy);
}

}  // namespace
}  // namespace nadir::sim
