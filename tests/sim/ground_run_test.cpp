#include <gtest/gtest.h>

#include "sim/flown_run.h"

namespace nadir::sim {
namespace {

/// Flights from the ground and back to it by models whose parameter files have a gear.
class GroundRun : public FlownRun {
 protected:
  /// A circuit to the north and back, for speeds of a vehicle.
  static std::string circuit(const std::string& model, double rotate_mps, double approach_mps) {
    return fmt::format(
        "  p:\n    model: {}\n    start: {{height: 0 agl, yaw_deg: 0}}\n    takeoff: {{rotate_mps: {}}}\n"
        "    turn_radius_m: 100\n    mission: [{{north_m: 600, east_m: 0, height: 50 agl}}, {{north_m: 600, east_m: "
        "400}}, {{north_m: -1150, east_m: 400}}, {{north_m: -1150, east_m: 0, height: 50 agl}}]\n"
        "    land: {{north_m: 100, east_m: 0, yaw_deg: 0, airspeed_mps: {}}}\n",
        model, rotate_mps, approach_mps);
  }
  std::vector<std::string> events(const std::string& vehicle, const std::string& duration_s) {
    auto run = prepare(vehicle, duration_s);
    if (!run) return {run.error().message};
    render::Renderer renderer({.threads = 1});
    const auto done = run->execute(renderer, {}, false, 0);
    if (!done) return {done.error().message};
    std::vector<std::string> names;
    for (const RunEvent& event : done->events)
      names.push_back(event.event.ends_flight ? in_words(event) : event.event.name);
    return names;
  }
};

const std::vector<std::string> there_and_back = {"lift-off", "touch-down", "landed"};

TEST_F(GroundRun, ModelsWithAGearTakeOffAndLand) {
  for (const char* wind :
       {"", "air: {wind: {from_deg: 0, speed_mps: 3}}\n", "air: {wind: {from_deg: 90, speed_mps: 3}}\n"}) {
    air = wind;
    EXPECT_EQ(events(circuit("aerosonde", 16, 18), "260"), there_and_back) << wind;
    EXPECT_EQ(events(circuit("anaconda", 11, 13), "400"), there_and_back) << wind;
  }
}

TEST_F(GroundRun, AGearOfOnesOwnFliesTheSame) {
  const std::string gear = "{base: anaconda, gear: {nose wheel: {most_n: 300}}}";
  EXPECT_EQ(events(circuit(gear, 11, 13), "400"), there_and_back);
  const auto broken = events(circuit("{base: anaconda, gear: {left wheel: {most_n: 15}}}", 11, 13), "400");
  ASSERT_FALSE(broken.empty());
  EXPECT_NE(broken.back().find("left wheel"), std::string::npos) << broken.back();
}

TEST_F(GroundRun, AModelWithoutAGearSaysThatItsFileNeedsOne) {
  const auto told = events(circuit("my_twin_dream", 11, 13), "100");
  ASSERT_EQ(told.size(), 1u);
  EXPECT_NE(told[0].find("expected `gear:` with wheels or skids in its parameter file"), std::string::npos) << told[0];
}

}  // namespace
}  // namespace nadir::sim
