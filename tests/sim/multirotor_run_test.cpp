#include <gtest/gtest.h>

#include <cmath>

#include "sim/flown_run.h"

namespace nadir::sim {
namespace {

class MultirotorRun : public FlownRun {
 protected:
  static std::string copter(const std::string& model, const std::string& more = "") {
    return "  c:\n    model: " + model +
           "\n    start: {height: 0 agl, yaw_deg: 90}\n"
           "    mission: [{north_m: 0, east_m: 0, height: 10 agl, hold_s: 1}, {north_m: 12, east_m: -5, yaw_deg: "
           "30}]\n" +
           more;
  }
  std::string refusal(const std::string& vehicle) {
    const auto run = prepare(vehicle, "5");
    return run ? "ran" : run.error().message;
  }
};

TEST_F(MultirotorRun, TakesOffAndSeesTheGroundFromItsWaypoints) {
  for (const char* model : {"multirotor", "multirotor_sil", "multirotor_lumped"}) {
    const Recorder seen = execute(copter(model, "    sensors:\n" + sensor("cam", "1")), "40", true);
    const auto& states = seen.states.at("c");
    EXPECT_NEAR(states.front().place.height_m, 20.15, 0.02) << "stands on its legs";
    const VehicleState& end = states.back();
    ASSERT_TRUE(end.flight);
    EXPECT_NEAR(end.place.height_m, 30, 0.2) << model;
    EXPECT_NEAR(geodesy::to_degrees(end.attitude.yaw_rad), 30, 3) << model;
    EXPECT_LT(std::hypot(end.flight->off_path_right_m, end.flight->off_path_above_m), 0.5) << model;
    EXPECT_EQ(seen.exposures.at("c/cam").size(), 41U);
  }
}

TEST_F(MultirotorRun, RunsAgainToTheSameBitsFromTheFileThatItWrote) {
  const std::string vehicle = copter("multirotor", "    battery: {cells: 6, capacity_ah: 10}\n");
  const auto file = read_run_file(
      folder.write("run.yaml",
                   "duration_s: 8\nscene:\n  ground: 20\n  layers:\n    eo: {map: m.tif, bands: [4, 2]}\n"
                   "air: {wind: {from_deg: 146, speed_mps: 3.6}, turbulence: {intensity: light}}\nvehicles:\n" +
                       vehicle));
  ASSERT_TRUE(file) << file.error().message;
  const auto fly = [](const RunFile& run_file) {
    Recorder recorder;
    auto run = sim::Run::prepare(run_file);
    EXPECT_TRUE(run) << (run ? "" : run.error().message);
    render::Renderer renderer({.threads = 1});
    const std::array<Sink*, 1> sinks = {&recorder};
    EXPECT_TRUE(run->execute(renderer, sinks, false, 0));
    return std::pair(recorder, to_yaml(run->file()));
  };
  const auto [first, text] = fly(*file);
  const auto again = read_run_file(folder.write("again.yaml", text));
  ASSERT_TRUE(again) << again.error().message << text;
  const auto [second, text_again] = fly(*again);
  EXPECT_EQ(text, text_again);
  const auto &a = first.states.at("c"), &b = second.states.at("c");
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_TRUE(same(a[i], b[i]));
    EXPECT_EQ(a[i].flight->channels, b[i].flight->channels);
  }
}

TEST_F(MultirotorRun, SaysWhatIsWrong) {
  EXPECT_NE(refusal(copter("multirotr")).find("did you mean 'multirotor'?"), std::string::npos);
  EXPECT_NE(refusal(copter("multirotor", "    turn_radius_m: 30\n")).find("unknown key 'vehicles.c.turn_radius_m'"),
            std::string::npos);
  EXPECT_NE(refusal(copter("multirotor_sil", "    battery: {cells: 6}\n")).find("a battery needs electric motors"),
            std::string::npos);
  EXPECT_NE(refusal(copter("multirotor", "    battery: {cells: 60, charge_share: 2}\n")).find("expected 1 to 24"),
            std::string::npos);
  EXPECT_NE(refusal(copter("multirotor", "    repeat_mission: true\n")).find("begins in the air"), std::string::npos);
  const std::string under =
      "  c:\n    model: multirotor\n    start: {height: 30 agl}\n    mission: [{north_m: 5, east_m: 0, height: -3 "
      "agl}]\n";
  EXPECT_NE(refusal(under).find("'vehicles.c.mission[0]': expected a height above the ground"), std::string::npos)
      << refusal(under);
}

}  // namespace
}  // namespace nadir::sim
