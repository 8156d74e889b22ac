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
    EXPECT_NEAR(states.front().place.height_m, 20.165, 0.02) << "stands on its legs, 15 to 18 cm high";
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

TEST_F(MultirotorRun, AModelIsANameOrAFileOrABaseWithWhatDiffers) {
  const auto read = [&](const std::string& model, const std::string& more = "") {
    const auto file = read_run_file(folder.write(
        "run.yaml", "duration_s: 2\nscene:\n  layers:\n    eo: {map: m.tif}\nvehicles:\n" + copter(model, more)));
    EXPECT_TRUE(file) << file.error().message;
    return file.value();
  };
  const auto vehicle = [&](const RunFile& file) { return file.vehicles[0].second.multirotor_vehicle(); };
  const std::string base =
      "{base: multirotor, mass_kg: 2.4, battery: {cells: 6, capacity_ah: 8, resistance_ohm: 0.03}}";
  const Multirotor light = vehicle(read(base));
  EXPECT_EQ(light.mass.mass_kg(), 2.4);
  EXPECT_EQ(light.battery->capacity_ah, 8);

  folder.write("my_copter.yaml", to_yaml(light));
  const RunFile of_file =
      read("{file: my_copter.yaml, mass_kg: 2.5}", "    battery: {capacity_ah: 4, charge_share: 0.5}\n");
  const Multirotor changed = vehicle(of_file);
  EXPECT_EQ(changed.mass.mass_kg(), 2.5);
  EXPECT_EQ(changed.battery->capacity_ah, 4);
  EXPECT_EQ(changed.battery->resistance_ohm, 0.03) << "the model's own";
  EXPECT_EQ(of_file.vehicles[0].second.multirotor->charge_share, 0.5);

  // It flies, and does again from what was written of it
  const Recorder seen = execute(copter("{file: my_copter.yaml}"), "20", false);
  EXPECT_NEAR(seen.states.at("c").back().place.height_m, 30, 0.5);
  const std::string written = to_yaml(of_file);
  const auto again = read_run_file(folder.write("again.yaml", written));
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(to_yaml(*again), written);
}

TEST_F(MultirotorRun, FaultsOfAModelAreToldByTheirLines) {
  folder.write("my_copter.yaml", "base: multirotor\nmass_kg: -1\nrotors: {front left: {turns: right}}\n");
  const std::string in_file = refusal(copter("{file: my_copter.yaml}"));
  for (const char* part : {"my_copter.yaml:2: 'mass_kg'", "my_copter.yaml:3: 'rotors.front left.turns'"})
    EXPECT_NE(in_file.find(part), std::string::npos) << part << "\n" << in_file;
  EXPECT_EQ(in_file.find("mission"), std::string::npos) << "its kind is known in spite of its faults\n" << in_file;
  const std::string here =
      refusal(copter("{base: multirotor, mass_kg: -1, bttery: {cells: 6}}", "    flight: {sped_mps: 3}\n"));
  for (const char* part : {"'vehicles.c.model.mass_kg': expected a number above 0",
                           "unknown key 'vehicles.c.model.bttery'", "unknown key 'vehicles.c.flight.sped_mps'"})
    EXPECT_NE(here.find(part), std::string::npos) << part << "\n" << here;
  EXPECT_EQ(here.find("mission"), std::string::npos) << "its kind is known in spite of its faults\n" << here;
  EXPECT_NE(refusal(copter("{base: multirotor, mass_kg: 16}")).find("vehicle c: "), std::string::npos);
}

TEST_F(MultirotorRun, SaysWhatIsWrong) {
  const std::string misspelt = refusal(copter("multirotr"));
  EXPECT_NE(misspelt.find("did you mean 'multirotor'?"), std::string::npos);
  EXPECT_EQ(misspelt.find("mission"), std::string::npos) << "what it flies is that of a multirotor\n" << misspelt;
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
