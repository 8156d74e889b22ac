#include "nadir/sim/vehicle_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <random>
#include <string>

#include "nadir/sim/trim.h"
#include "support/temporary_folder.h"
#include "vehicle/aerosonde.h"
#include "vehicle/models.h"
#include "vehicle/vehicle_files.h"

namespace nadir::sim {
namespace {

std::string changed(std::string_view key, std::string_view line) { return with(model_text("aerosonde"), key, line); }

/// A file of a fixed wing that is good.
FixedWing fixed_wing(const std::string& text) {
  const auto vehicle = parse_vehicle("vehicle.yaml", text);
  EXPECT_TRUE(vehicle) << vehicle.error().message;
  return std::get<FixedWing>(vehicle.value());
}

TEST(VehicleModels, AreTheFilesOfTheFolderByName) {
  const auto models = vehicle_models();
  EXPECT_EQ(models.size(), 9u);
  for (const std::string_view name : models) {
    const auto shipped = vehicle_model(name);
    ASSERT_TRUE(shipped) << shipped.error().message;
    EXPECT_EQ(to_yaml(*shipped), to_yaml(parse_vehicle("file", model_text(name)).value())) << name;
  }
  const auto none = vehicle_model("anacondo");
  ASSERT_FALSE(none);
  EXPECT_TRUE(has(none.error().message, "did you mean 'anaconda'?")) << none.error().message;
  EXPECT_TRUE(has(fixed_wing_model("multirotor").error().message, "is no fixed wing"));
  EXPECT_TRUE(has(multirotor_model("junker").error().message, "is no multirotor"));
}

TEST(VehicleModels, AreReadBackFromWhatIsWrittenToTheSameBits) {
  for (const std::string_view name : fixed_wing_models()) {
    const FixedWing vehicle = fixed_wing_model(name).value();
    const FixedWing again = fixed_wing(to_yaml(vehicle, "  "));
    EXPECT_EQ(to_yaml(again), to_yaml(vehicle)) << name;
    const AirData air = air_data_from({15, 1, 1});
    EXPECT_EQ(loads(vehicle, air, {0.1, 0.2, 0.3}, {0.1, 0.1, 0.1}, 0.6, 1.2).force_body_n,
              loads(again, air, {0.1, 0.2, 0.3}, {0.1, 0.1, 0.1}, 0.6, 1.2).force_body_n);
  }
}

TEST(VehicleModels, TheAerosondeIsWhatItsSourcesPrint) {
  const FixedWing& a = aerosonde();
  EXPECT_EQ(a.mass.mass_kg(), 11.0);
  EXPECT_EQ(a.mass.inertia_kgm2()(0, 2), -0.1204);
  EXPECT_EQ(a.drag.zero, 0.043);
  EXPECT_EQ(a.pitch.q, -38.21);
  EXPECT_EQ(std::get<Propulsion>(a.propulsion).cq2, -0.01664);
  EXPECT_EQ(a.max_deflection_rad, geodesy::to_radians(40));
}

TEST(VehicleModels, UnusualOnesAreWarnedOf) {
  EXPECT_TRUE(vehicle_warnings(vehicle_model("aerosonde").value()).empty());
  EXPECT_EQ(vehicle_warnings(vehicle_model("my_twin_dream").value()).size(), 1u) << "a wing that droops";
  const auto warning = [](const std::string& text) {
    const auto warnings = vehicle_warnings(fixed_wing("base: aerosonde\n" + text));
    EXPECT_EQ(warnings.size(), 1u) << text;
    return warnings.empty() ? "" : warnings[0];
  };
  EXPECT_TRUE(has(warning("coefficients: {pitch: {alpha: 0.3}}"), "unstable in pitch"));
  EXPECT_TRUE(has(warning("gear: {nose wheel: {place_m: [-0.2, 0, 0.3]}}"), "tips over on the ground"));
  EXPECT_TRUE(has(warning("gear: {nose wheel: {stiffness_npm: 200}, left wheel: {stiffness_npm: 200}, right wheel: "
                          "{stiffness_npm: 200}}"),
                  "soft on the ground: its gear gives by 0.18 m"));
}

TEST(VehicleFile, ChangesSingleValuesOfABase) {
  const FixedWing vehicle = fixed_wing("base: aerosonde\nmass_kg: 12\npropulsion: {electric: {max_voltage_v: 40}}\n");
  EXPECT_EQ(vehicle.mass.mass_kg(), 12);
  EXPECT_EQ(vehicle.span_m, 2.8956);
  EXPECT_EQ(std::get<Propulsion>(vehicle.propulsion).max_voltage_v, 40);
  EXPECT_EQ(std::get<Propulsion>(vehicle.propulsion).diameter_m, 0.508);
}

TEST(VehicleFile, AnotherKindOfPropulsionNeedsAllOfItsParameters) {
  const std::string said = message("base: aerosonde\npropulsion: {slipstream: {area_m2: 0.2}}\n");
  EXPECT_TRUE(has(said, "expected the key 'propulsion.slipstream.full_speed_mps'")) << said;
}

TEST(VehicleFile, AMapNamesAFileAndChangesIt) {
  const test::TemporaryFolder folder;
  folder.write("plane.yaml", model_text("junker"));
  const auto yaml = YamlMap::parse("run.yaml", "file: plane.yaml\nmass_kg: 2\n").value();
  const auto vehicle = std::get<FixedWing>(read_vehicle(yaml, folder.path()));
  ASSERT_TRUE(yaml.finish()) << yaml.finish().error().message;
  EXPECT_EQ(vehicle.mass.mass_kg(), 2);
  EXPECT_EQ(vehicle.lift.alpha, 3.45);

  const auto missing = YamlMap::parse("run.yaml", "file: plain.yaml\n").value();
  read_vehicle(missing, folder.path());
  EXPECT_TRUE(has(missing.finish().error().message, "run.yaml:1: 'file': ")) << missing.finish().error().message;
}

TEST(VehicleFile, KeysOfAnotherKindAreUnknownOverAFileToo) {
  const test::TemporaryFolder folder;
  folder.write("plane.yaml", model_text("junker"));
  const auto yaml = YamlMap::parse("run.yaml", "file: plane.yaml\nbattery: {cells: 6}\n").value();
  read_vehicle(yaml, folder.path());
  ASSERT_FALSE(yaml.finish());
  EXPECT_TRUE(has(yaml.finish().error().message, "unknown key 'battery'")) << yaml.finish().error().message;
}

TEST(VehicleFile, UnitsAndSignsThatCannotBeAreNamed) {
  struct Case {
    std::string_view key, line, expected;
  };
  for (const Case& c : {Case{"mass_kg:", "mass_kg: -3", "'mass_kg': expected a number above 0"},
                        Case{"mass_kg:", "mass_kg: 1.1e7", "is it in grams?"},
                        Case{"  {jxx:", "  {jxx: 0.8, jyy: 1.1, jzz: 3.0, jxz: 0}", "no body has principal moments"},
                        Case{"  {jxx:", "  {jxx: 822.4, jyy: 1135, jzz: 1759, jxz: 120}", "radius of gyration"},
                        Case{"  span_m:", "  span_m: 2895.6", "is it in millimetres?"},
                        Case{"  chord_m:", "  chord_m: 3", "expected a chord of at most the span"},
                        Case{"  area_m2:", "  area_m2: 55", "expected an area near span times chord"},
                        Case{"  alpha_rad:", "  alpha_rad: 26.9", "'stall.alpha_rad': expected a number above 0"},
                        Case{"  alpha_rad:", "  alpha_rad: 26.9", "is it in degrees?"},
                        Case{"  max_deflection_rad:", "  max_deflection_rad: 40", "is it in degrees?"},
                        Case{"  time_constant_s:", "  time_constant_s: 20", "is it in milliseconds?"},
                        Case{"  lift:", "  lift: {alpha: -5}", "lift rises with alpha"},
                        Case{"  lift:", "  lift: {alpha: 0.098}", "is it per degree?"},
                        Case{"  roll:", "  roll: {aileron: -0.17}", "a positive aileron rolls right"},
                        Case{"  pitch:", "  pitch: {elevator: -0.9, q: 3}", "pitch.q: expected at most 0"},
                        Case{"    kq_vspr:", "    kq_vspr: 145", "rpm a volt"},
                        Case{"    thrust:", "    thrust: [0.1, 0.2]", "expected 3 numbers, found 2"},
                        Case{"    torque:", "    torque: [0, 0, 0]", "needs torque to turn"},
                        Case{"kind:", "kind: zeppelin", "expected fixed_wing or multirotor, found 'zeppelin'"},
                        Case{"cruise_mps:", "cruse_mps: 25", "unknown key 'cruse_mps'; did you mean 'cruise_mps'?"},
                        Case{"cruise_mps:", "cruise_mps: 25\nbattery: {cells: 6}", "unknown key 'battery'"},
                        Case{"cruise_mps:", "cruise_mps: 25\nrotors: {}", "unknown key 'rotors'"},
                        Case{"cruise_mps:", "cruise_mps: .nan", "expected a number"}}) {
    const std::string said = message(changed(c.key, c.line));
    EXPECT_TRUE(has(said, c.expected)) << c.line << "\n" << said;
    EXPECT_TRUE(said.starts_with("vehicle.yaml:")) << said;
  }
}

TEST(VehicleFile, AllFaultsAreInOneMessageWithTheirLines) {
  std::string text = changed("mass_kg:", "mass_kg: -3");
  text = with(text, "  span_m:", "  span_m: 2895.6");
  text = with(text, "  lift:", "  lift: {alpha: -5, alpa: 3}");
  const std::string said = message(text);
  for (const char* part :
       {"vehicle.yaml:7: 'mass_kg'", "vehicle.yaml:12: 'wing.span_m'", "vehicle.yaml:18: 'coefficients'",
        "unknown key 'coefficients.lift.alpa'; did you mean 'alpha'?"})
    EXPECT_TRUE(has(said, part)) << part << "\n" << said;
}

TEST(VehicleFile, CutOrSpoiltAnywhereItIsReadOrRefused) {
  const std::string good = model_text("my_twin_dream");
  for (std::size_t length = 0; length < good.size(); length += 7) message(good.substr(0, length));
  std::mt19937 random(1);
  int refused = 0;
  for (int i = 0; i < 2000; ++i) {
    std::string text = good;
    for (int k = 0; k < 3; ++k)
      text[std::uniform_int_distribution<std::size_t>(0, text.size() - 1)(random)] =
          static_cast<char>(std::uniform_int_distribution<int>(0, 255)(random));
    const auto vehicle = parse_vehicle("spoilt", text);
    refused += !vehicle;
    if (!vehicle) continue;
    const FixedWing wing = std::get<FixedWing>(*vehicle);
    (void)trim(wing, {.airspeed_mps = wing.cruise_mps}, 1.2, 9.81);
  }
  EXPECT_GT(refused, 300);
  EXPECT_LT(refused, 2000) << "most of the file is comments";
}

TEST(VehicleFile, AGearIsPointsByName) {
  const ContactGear gear = aerosonde().gear.value();
  ASSERT_EQ(gear.points().size(), 8u);
  EXPECT_EQ(gear.points()[0].name, "nose wheel");
  EXPECT_EQ(gear.points()[0].steering, 1);
  EXPECT_EQ(gear.points()[1].body_m, Eigen::Vector3d(-0.07, -0.35, 0.3));
  EXPECT_EQ(gear.points()[7].kind, ContactPoint::Kind::Part);
  EXPECT_FALSE(fixed_wing_model("junker").value().gear);

  const ContactGear changed = fixed_wing(
                                  "base: aerosonde\ngear:\n  nose wheel: {most_n: 900}\n"
                                  "  tail: {kind: skid, stiffness_npm: 3000, damping_spm: 1}\n"
                                  "  probe: {kind: part, place_m: [0.9, 0, 0]}\n")
                                  .gear.value();
  ASSERT_EQ(changed.points().size(), 9u);
  EXPECT_EQ(changed.points()[0].most_n, 900);
  EXPECT_EQ(changed.points()[0].stiffness_npm, 2500);
  EXPECT_EQ(changed.points()[7].kind, ContactPoint::Kind::Skid);
  EXPECT_EQ(changed.points()[7].body_m.x(), -1.1);
  EXPECT_EQ(changed.points()[8].name, "probe");
}

TEST(VehicleFile, AGearThatCannotBeIsToldByLine) {
  const std::string said = message(
      "base: junker\ngear:\n"
      "  left: {kind: wheel, place_m: [0, -0.2, 0.2], stiffness_npm: -3, damping_spm: 1, friction: 0.5}\n"
      "  right: {kind: wheel, place_m: [0, 0.2], stiffness_npm: 3000, damping_spm: 1, steerin: 1}\n"
      "  tail:\n    kind: wheel\n    place_m: [-0.5, 0, 0.1]\n    stiffness_npm: 1e3\n    damping_spm: 1\n"
      "    friction: 0.3\n    brake_friction: 0.4\n"
      "  belly: {kind: prt, place_m: [0, 0, 100000]}\n"
      "  skid: {kind: skid, place_m: [0, 0, 0.1]}\n  nose: {kind: part, place_m: [1, 0, 0], friction: 1}\n");
  for (const char* part :
       {"vehicle.yaml:3: 'gear.left.stiffness_npm': expected 1 to 1e+08 N/m, found -3",
        "vehicle.yaml:4: 'gear.right.place_m': expected 3 numbers, found 2", "did you mean 'steering'?",
        "vehicle.yaml:11: 'gear.tail.brake_friction': expected 0.03 to 0.3 with rolling_friction, found 0.43",
        "vehicle.yaml:12: 'gear.belly.kind': no kind of contact point 'prt'; did you mean 'part'?",
        "is it in millimetres?", "vehicle.yaml:13: expected the key 'gear.skid.stiffness_npm'",
        "vehicle.yaml:14: unknown key 'gear.nose.friction'"})
    EXPECT_TRUE(has(said, part)) << part << "\n" << said;
  EXPECT_TRUE(has(message("base: junker\ngear: none\n"), "'gear': expected 'key: value' lines below it"));
  std::string many = "base: junker\ngear:\n";
  for (int i = 0; i < 33; ++i) many += "  p" + std::to_string(i) + ": {kind: part, place_m: [0, 0, 0]}\n";
  EXPECT_TRUE(has(message(many), "expected at most 32 contact points, found 33")) << message(many);
}

TEST(VehicleFile, AnyOtherFileIsRefused) {
  int files = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(NADIR_SOURCE_DIR) / "tests/data/awkward")) {
    if (!entry.is_regular_file()) continue;
    ++files;
    EXPECT_FALSE(read_vehicle_file(entry.path())) << entry.path();
  }
  EXPECT_GT(files, 10);
  EXPECT_FALSE(read_vehicle_file("/nonexistent/plane.yaml"));
  EXPECT_FALSE(read_vehicle_file("/"));
}

}  // namespace
}  // namespace nadir::sim
