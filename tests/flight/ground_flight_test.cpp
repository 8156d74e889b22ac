#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "nadir/sim/flight.h"
#include "nadir/sim/flown_fixed_wing.h"
#include "nadir/sim/plan_motion.h"
#include "vehicle/aerosonde.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;
using geodesy::Geodetic;

const Geodetic place = Geodetic::degrees(38.1, -0.76, 0);
const geodesy::LocalFrame scene(place);
constexpr double standing_m = 0.3;

/// A flight over the plane of the place, in wind.
struct Scenario {
  double height_m = 0;
  double yaw_rad = 0;
  std::vector<MissionItem> waypoints{Waypoint{600, 0, 50}, Waypoint{600, 400, 50}, Waypoint{-1300, 400, 50},
                                     Waypoint{-1300, 0, 50}};
  std::optional<TakeoffPlan> takeoff = TakeoffPlan{};
  std::optional<LandingPlan> landing = LandingPlan{.runway = {.from = {100, 0}, .height_m = standing_m}};
  AirframeLimits limits;
  bool fly_unstable = false;
  FixedWing vehicle = aerosonde();
  Vector3d wind_ned = Vector3d(-2, 1, 0);
  double launch_mps = 0;

  Geodetic start() const { return {place.lat_rad, place.lon_rad, height_m}; }
};

AirAlongPath air_of(const Scenario& scenario) {
  AirParts parts;
  parts.height_above_ground_m = [](const auto& p) { return (scene.enu_from_ecef() * p).xyz.z(); };
  parts.sources.push_back(std::make_unique<SteadyWind>(scenario.wind_ned, Shear{}));
  return AirAlongPath::start(std::move(parts), geodesy::ecef_from_geodetic(scenario.start()), {1, 0, 0}, 25).value();
}

FixedWingFlight setup(const Scenario& scenario) {
  std::vector<MissionItem> waypoints = scenario.waypoints;
  if (scenario.landing)
    for (const Waypoint& gate : approach(*scenario.landing, 300)) waypoints.push_back(gate);
  return {.vehicle = scenario.vehicle,
          .environment = Environment::flat(place),
          .scene = scene,
          .start = scenario.start(),
          .yaw_rad = scenario.yaw_rad,
          .wind_ned_mps = scenario.wind_ned,
          .mission = Mission::create({0, 0, std::max(scenario.height_m, 20.0)}, waypoints, 100,
                                     scenario.landing ? AfterMission::GoesOn : AfterMission::Circle)
                         .value(),
          .fly_unstable = scenario.fly_unstable,
          .ground = FixedWingGroundSetup{.ground = std::make_shared<PlaneGround>(scene, 0),
                                         .standing = scenario.height_m == 0,
                                         .launch_mps = scenario.launch_mps,
                                         .launch_pitch_rad = 0.2,
                                         .takeoff = scenario.takeoff,
                                         .landing = scenario.landing,
                                         .limits = scenario.limits}};
}

Result<Flight> make(const Scenario& scenario, const Scheme& scheme = {.method = Scheme::Method::Rk4, .steps = 4}) {
  FixedWingFlight flight = setup(scenario);
  flight.scheme = scheme;
  auto vehicle = fly_fixed_wing(std::move(flight));
  if (!vehicle) return fail(vehicle);
  return Flight(Environment::flat(place), air_of(scenario), std::move(*vehicle));
}

/// Flies until an event ends it or the time is over.
Flight flown(const Scenario& scenario, std::int64_t seconds) {
  Flight flight = make(scenario).value();
  while (!flight.ended() && flight.time_ns() < seconds * 1'000'000'000)
    EXPECT_TRUE(flight.fly(flight.time_ns() + Flight::period_ns));
  return flight;
}

/// Into the ground: straight on at a height that sinks.
Scenario dive() {
  return {.height_m = 60, .waypoints = {Waypoint{150, 0, 30}, Waypoint{600, 0, -100}}, .takeoff = {}, .landing = {}};
}

TEST(GroundFlight, ACircuitTellsOfLiftOffTouchDownAndLanding) {
  Flight flight = flown({}, 260);
  EXPECT_FALSE(flight.ended());
  ASSERT_EQ(flight.events().size(), 3u);
  EXPECT_EQ(flight.events()[0].name, "lift-off");
  EXPECT_EQ(flight.events()[1].name, "touch-down");
  EXPECT_EQ(flight.events()[2].name, "landed");
  const FlightState end = flight.at(flight.time_ns()).value();
  EXPECT_EQ(end.data.channels[3], 3) << "wheels on the ground";
  EXPECT_NEAR(end.data.channels[4], 11 * 9.81, 5) << "their force, less what the wind lifts";
  EXPECT_NEAR(end.data.specific_force_mps2.z(), -9.81, 0.05) << "what an accelerometer at rest feels";
}

/// How far a flight is off its path from the hand-over on, for ten seconds.
struct HandOver {
  double first_m = 0, right_m = 0, above_m = 0;
};

HandOver handed_over(const Scenario& scenario) {
  const Waypoint begins = climb_out_end(setup(scenario), air_of(scenario)).value();
  FixedWingFlight flight = setup(scenario);
  flight.mission = Mission::create(begins, scenario.waypoints, 100).value();
  Flight flown(Environment::flat(place), air_of(scenario), fly_fixed_wing(std::move(flight)).value());
  HandOver out;
  std::int64_t since_ns = 0;
  while (since_ns == 0 || flown.time_ns() < since_ns + 10'000'000'000) {
    EXPECT_TRUE(flown.decide());
    const FlightData data = flown.at(flown.time_ns()).value().data;
    // On the ground and in the climb-out there is no path to be off
    if (since_ns == 0 && data.off_path_right_m != 0) {
      since_ns = flown.time_ns();
      out.first_m = std::hypot(data.off_path_right_m, data.off_path_above_m);
    }
    out.right_m = std::max(out.right_m, std::abs(data.off_path_right_m));
    out.above_m = std::max(out.above_m, std::abs(data.off_path_above_m));
    EXPECT_TRUE(flown.move());
    if (flown.ended() || flown.time_ns() > 120'000'000'000) {
      ADD_FAILURE() << "no hand-over";
      break;
    }
  }
  return out;
}

TEST(GroundFlight, AMissionBeginsWhereTheClimbOutEnds) {
  struct Case {
    Vector3d wind_ned;
    double launch_mps = 0;
    std::vector<MissionItem> waypoints = Scenario{}.waypoints;
  };
  const std::vector<MissionItem> aside{Waypoint{0, 700, 60}, Waypoint{-800, 700, 60}};
  for (const Case& c : {Case{{0, 0, 0}}, Case{{-5, 0, 0}}, Case{{3, 0, 0}}, Case{{0, 4, 0}}, Case{{-5, 0, 0}, 14},
                        Case{{0, 0, 0}, 0, aside}, Case{{-3, 3, 0}, 0, aside}}) {
    Scenario scenario{.waypoints = c.waypoints, .landing = {}, .wind_ned = c.wind_ned, .launch_mps = c.launch_mps};
    if (c.launch_mps > 0) {
      scenario.height_m = 1.5;
      scenario.takeoff->launched = true;
    }
    const HandOver off = handed_over(scenario);
    const std::string name = fmt::format("{} items, launched at {} m/s in {}, {} m/s", c.waypoints.size(), c.launch_mps,
                                         c.wind_ned.x(), c.wind_ned.y());
    EXPECT_LT(off.first_m, 0.05) << name << ": a period of climbing, and rounding";
    EXPECT_LT(off.right_m, 2) << name << ": rolling into a turn";
    EXPECT_LT(off.above_m, 1.5) << name << ": from one rate of climb to another";
  }
}

TEST(GroundFlight, ATakeOffThatNeverLeavesTheGroundIsSaid) {
  Scenario scenario;
  scenario.takeoff->rotate_mps = 60;
  const auto end = climb_out_end(setup(scenario), air_of(scenario));
  ASSERT_FALSE(end);
  EXPECT_NE(end.error().message.find("has not lifted off after 180 s"), std::string::npos) << end.error().message;
}

TEST(GroundFlight, LookingAtAContactChangesNothing) {
  Flight seen = make({}).value(), alone = make({}).value();
  for (int i = 0; i < 600; ++i) {
    ASSERT_TRUE(seen.fly(seen.time_ns() + Flight::period_ns));
    for (const std::int64_t before : {9'000'000, 1'234'567}) {
      const FlightState within = seen.at(seen.time_ns() - before).value();
      EXPECT_TRUE(to_vector(within.body).allFinite());
    }
    ASSERT_TRUE(alone.fly(alone.time_ns() + Flight::period_ns));
  }
  EXPECT_EQ(to_vector(seen.vehicle().body()), to_vector(alone.vehicle().body()));
}

TEST(GroundFlight, APathIntoTheGroundEndsInACrashThatSaysWhatAndWhere) {
  Flight flight = flown(dive(), 60);
  ASSERT_TRUE(flight.ended());
  const FlightEvent& crash = *flight.ended();
  EXPECT_EQ(crash.name, "crash");
  EXPECT_TRUE(crash.ends_flight);
  for (const char* part : {" m above the ellipsoid", "airspeed", "pitch", "deg/s"})
    EXPECT_NE(crash.text.find(part), std::string::npos) << crash.text;
  // What it was until then can be asked for; nothing later can, and nothing flies on
  const FlightState last = flight.at(crash.time_ns).value();
  EXPECT_TRUE(to_vector(last.body).allFinite());
  EXPECT_LT((scene.enu_from_ecef() * last.body.position).xyz.z(), 1);
  EXPECT_FALSE(flight.at(crash.time_ns + 1));
  EXPECT_FALSE(flight.fly(flight.time_ns() + Flight::period_ns));
}

TEST(GroundFlight, TheCrashIsTheSameWhateverScheme) {
  const std::int64_t rk4_ns = flown(dive(), 60).ended()->time_ns;
  Flight other = make(dive(), {.method = Scheme::Method::DormandPrince}).value();
  while (!other.ended()) ASSERT_TRUE(other.fly(other.time_ns() + Flight::period_ns));
  EXPECT_NEAR(static_cast<double>(other.ended()->time_ns - rk4_ns) * 1e-9, 0, 1e-3);
}

TEST(GroundFlight, ALandingHarderThanTheLimitIsACrash) {
  Scenario scenario;
  scenario.limits.sink_mps = 0.2;
  Flight flight = flown(scenario, 260);
  ASSERT_TRUE(flight.ended());
  EXPECT_NE(flight.ended()->text.find("where 0.20 are all that it stands"), std::string::npos) << flight.ended()->text;
}

TEST(GroundFlight, ALoadBeyondTheLimitBreaksTheAirframe) {
  Scenario scenario = dive();
  scenario.height_m = 1000;
  scenario.waypoints = {Waypoint{300, 0, 1000}, Waypoint{300, 300, 1000}, Waypoint{0, 300, 1000}};
  scenario.limits.load_factor = 1.2;
  Flight flight = flown(scenario, 60);
  ASSERT_TRUE(flight.ended());
  EXPECT_NE(flight.ended()->text.find("the airframe breaks under 1.2 g"), std::string::npos) << flight.ended()->text;
}

TEST(GroundFlight, AFlightThatDivergesIsSaidWithTimeAndStateInWords) {
  // Roll damping of the wrong sign, and much of it
  Scenario scenario = dive();
  scenario.height_m = 1000;
  scenario.waypoints = {Waypoint{5000, 0, 1000}};
  scenario.vehicle.roll.p = 20;
  scenario.fly_unstable = true;
  Flight flight = flown(scenario, 60);
  ASSERT_TRUE(flight.ended());
  EXPECT_EQ(flight.ended()->name, "diverged");
  for (const char* part : {"airspeed", "roll", "rates", " m above the ellipsoid"})
    EXPECT_NE(flight.ended()->text.find(part), std::string::npos) << flight.ended()->text;
  EXPECT_EQ(flight.ended()->text.find("nan"), std::string::npos) << flight.ended()->text;
  EXPECT_TRUE(to_vector(flight.at(flight.ended()->time_ns).value().body).allFinite());
}

TEST(GroundFlight, ItsMotionCanBePlanned) {
  const auto plan = plan_motion([](const Scheme& scheme) { return make({}, scheme); }, 1e-2, 30'000'000'000);
  ASSERT_TRUE(plan) << plan.error().message;
  const auto crashes = plan_motion([](const Scheme& scheme) { return make(dive(), scheme); }, 1e-3, 30'000'000'000);
  EXPECT_TRUE(crashes) << crashes.error().message;
  Scenario unstable = dive();
  unstable.height_m = 1000;
  unstable.vehicle.roll.p = 20;
  unstable.fly_unstable = true;
  const auto diverges = plan_motion([&](const Scheme& s) { return make(unstable, s); }, 1e-3, 30'000'000'000);
  ASSERT_TRUE(diverges) << diverges.error().message;
  EXPECT_NE(diverges->why.find("diverges"), std::string::npos) << diverges->why;
}

}  // namespace
}  // namespace nadir::sim
