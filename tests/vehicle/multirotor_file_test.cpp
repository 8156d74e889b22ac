#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "nadir/sim/mixer.h"
#include "nadir/sim/multirotor_ground.h"
#include "nadir/sim/multirotor_trim.h"
#include "vehicle/models.h"
#include "vehicle/vehicle_files.h"

namespace nadir::sim {
namespace {

const char* const models[] = {"multirotor", "multirotor_sil", "multirotor_lumped"};

std::string changed(std::string_view key, std::string_view line) { return with(model_text("multirotor"), key, line); }

Multirotor multirotor(const std::string& text) {
  const auto vehicle = parse_vehicle("vehicle.yaml", text);
  EXPECT_TRUE(vehicle) << vehicle.error().message;
  return std::get<Multirotor>(vehicle.value());
}

TEST(MultirotorFile, AreReadBackFromWhatIsWrittenToTheSameBits) {
  for (const char* name : models) {
    Multirotor vehicle = multirotor_model(name).value();
    if (name == models[0]) {
      vehicle.battery = lithium_polymer(6, 10, 0.02);
      vehicle.rotors[2].rise_time_constant_s = 0.1;
      vehicle.ground_effect = {.law = GroundEffect::Law::Polynomial, .force_n = {-1, 2, 3, 4, 5}};
    }
    const Multirotor again = multirotor(to_yaml(vehicle, "    "));
    EXPECT_EQ(to_yaml(again), to_yaml(vehicle)) << name;
    ASSERT_EQ(again.rotors.size(), vehicle.rotors.size());
    for (std::size_t i = 0; i < vehicle.rotors.size(); ++i) {
      EXPECT_EQ(again.rotors[i].position_m, vehicle.rotors[i].position_m);
      EXPECT_EQ(again.rotors[i].thrust_axis, vehicle.rotors[i].thrust_axis);
      EXPECT_EQ(again.rotors[i].drive, vehicle.rotors[i].drive);
      EXPECT_EQ(again.rotors[i].rise_time_constant_s, vehicle.rotors[i].rise_time_constant_s);
    }
    EXPECT_EQ(trim(again, {.forward_mps = 3}, 1.2, 9.81, 5).value().pitch_rad,
              trim(vehicle, {.forward_mps = 3}, 1.2, 9.81, 5).value().pitch_rad);
  }
}

TEST(MultirotorFile, RotorsAreNamedAndDriven) {
  const Multirotor& quad = quadrotor();
  ASSERT_EQ(quad.rotors.size(), 4u);
  EXPECT_EQ(quad.rotors[0].name, "front right");
  EXPECT_FALSE(quad.rotors[0].clockwise);
  EXPECT_EQ(quad.rotors[3].name, "front left");
  EXPECT_TRUE(quad.rotors[3].clockwise);
  EXPECT_EQ(std::get<ElectricDrive>(quad.rotors[2].drive).propulsion.ct1, -0.11006411);
  EXPECT_NEAR(pulsed_quadrotor().rotors[1].thrust_axis.norm(), 1, 1e-15) << "as published it is 1.00000004 long";
  EXPECT_EQ(lumped_multirotor().lumped->fall_time_constant_s[3], 0.2164);
}

TEST(MultirotorFile, ChangesSingleValuesOfABase) {
  const Multirotor vehicle = multirotor(
      "base: multirotor\nmass_kg: 2.4\ndrive: {electric: {rotor_inertia_kgm2: 2e-4}, rise_time_constant_s: 0.03}\n"
      "rotors: {front left: {place_m: [0.2, -0.2, 0.01]}}\nbattery: {cells: 4, capacity_ah: 5, resistance_ohm: "
      "0.02}\n");
  EXPECT_EQ(vehicle.mass.mass_kg(), 2.4);
  for (const Rotor& rotor : vehicle.rotors) {
    EXPECT_EQ(std::get<ElectricDrive>(rotor.drive).dynamics.rotor_inertia_kgm2, 2e-4);
    EXPECT_EQ(std::get<ElectricDrive>(rotor.drive).propulsion.kq_vspr, 0.028937);
    EXPECT_EQ(rotor.rise_time_constant_s, 0.03);
  }
  EXPECT_EQ(vehicle.rotors[3].position_m, Eigen::Vector3d(0.2, -0.2, 0.01));
  EXPECT_EQ(vehicle.rotors[0].position_m, quadrotor().rotors[0].position_m);
  EXPECT_NEAR(vehicle.battery->open_circuit.back().voltage_v, 16.8, 1e-12);
}

TEST(MultirotorFile, AGearOfItsOwnTakesThePlaceOfTheLegsThatFollowFromItsRotors) {
  const std::string legs =
      "base: multirotor\ngear:\n"
      "  left skid: {kind: skid, place_m: [0, -0.3, 0.4], stiffness_npm: 3000, damping_spm: 1, friction: 0.8, most_n: "
      "300}\n"
      "  right skid: {kind: skid, place_m: [0, 0.3, 0.4], stiffness_npm: 3000, damping_spm: 1, friction: 0.8, most_n: "
      "300}\n";
  const Multirotor vehicle = multirotor(legs);
  ASSERT_EQ(gear_of(vehicle).points().size(), 2u);
  EXPECT_EQ(gear_of(vehicle).points()[1].name, "right skid");
  EXPECT_EQ(standing_height_m(gear_of(vehicle)), 0.4);
  EXPECT_EQ(standing_height_m(gear_of(multirotor(to_yaml(vehicle)))), 0.4);
  EXPECT_LT(standing_height_m(gear_of(quadrotor())), 0.2);
  ASSERT_EQ(vehicle_warnings(vehicle).size(), 1u);
  EXPECT_PRED2(has, vehicle_warnings(vehicle)[0], "tips over on the ground");
  EXPECT_PRED2(has, message(with(legs, "  right skid:", "  right skid: {kind: skid, place_m: [0, 0.3, 0.4]}")),
               "vehicle.yaml:4: ");
}

/// A hexacopter of one's own, with one rotor that is driven otherwise.
TEST(MultirotorFile, AnyNumberOfRotorsFrom4To16CanBe) {
  std::string text = with(model_text("multirotor"), "rotors:", "rotors:");
  text = text.substr(0, text.find("rotors:")) + "rotors:\n";
  for (int i = 0; i < 6; ++i)
    text += fmt::format("  r{}: {{place_m: [{}, {}, 0], turns: {}{}}}\n", i, std::cos(i * std::numbers::pi / 3),
                        std::sin(i * std::numbers::pi / 3), i % 2 ? "clockwise" : "counterclockwise",
                        i == 5 ? ", drive: {electric: {resistance_ohm: 0.05}}" : "");
  const Multirotor hexacopter = multirotor(text);
  ASSERT_EQ(hexacopter.rotors.size(), 6u);
  EXPECT_EQ(std::get<ElectricDrive>(hexacopter.rotors[5].drive).propulsion.resistance_ohm, 0.05);
  EXPECT_EQ(std::get<ElectricDrive>(hexacopter.rotors[4].drive).propulsion.resistance_ohm, 0.042);
  EXPECT_EQ(to_yaml(multirotor(to_yaml(hexacopter))), to_yaml(hexacopter));
  EXPECT_TRUE(Mixer::create(hexacopter, 1.2));
}

TEST(MultirotorFile, ABatteryIsOfCellsOrOfACurve) {
  const std::string base = "base: multirotor\n";
  const Multirotor curve =
      multirotor(base +
                 "battery: {open_circuit: [{charge_share: 0, voltage_v: 18}, {charge_share: 1, voltage_v: 25}], "
                 "capacity_ah: 8, resistance_ohm: 0.03, other_current_a: 2}\n");
  EXPECT_EQ(open_circuit_v(*curve.battery, 4), 21.5);
  EXPECT_EQ(to_yaml(multirotor(to_yaml(curve))), to_yaml(curve));
  EXPECT_TRUE(has(to_yaml(multirotor(base + "battery: {cells: 6, capacity_ah: 8, resistance_ohm: 0.03}\n")),
                  "battery: {cells: 6,"));
}

TEST(MultirotorFile, UnitsAndSignsThatCannotBeAreNamed) {
  const std::string battery = "ground_effect: none\nbattery: ";
  struct Case {
    std::string_view key, line, expected;
  };
  for (const Case& c :
       {Case{"mass_kg:", "mass_kg: -3", "vehicle.yaml:6: 'mass_kg': expected a number above 0"},
        Case{"inertia_kgm2:", "inertia_kgm2: {jxx: 0.08, jyy: 0.08, jzz: 0.3}", "no body has principal moments"},
        Case{"inertia_kgm2:", "inertia_kgm2: {jxx: 80, jyy: 80, jzz: 120}", "radius of gyration"},
        Case{"    diameter_m:", "    diameter_m: 381", "is it in millimetres?"},
        Case{"    torque:", "    torque: [0, 0, 0]", "needs torque to turn"},
        Case{"    thrust:", "    thrust: [-0.1, 0, 0]", "'drive.electric.thrust': expected a first number above 0"},
        Case{"    kq_vspr:", "    kq_vspr: 330", "rpm a volt"},
        Case{"    max_voltage_v:", "    max_voltage_v: 0", "'drive.electric.max_voltage_v': expected a number above 0"},
        Case{"    no_load", "    no_load_current_a: 1.5\n    inductance_h: 8e-6", "it needs a rotor inertia"},
        Case{"    no_load", "    no_load_current_a: 1\n    rotor_inertia_kgm2: 2e-4\n    inductance_h: 0.01",
             "vehicle.yaml:18: 'drive.electric.inductance_h': an electrical time constant"},
        Case{"  front left:", "  front left: {place_m: [1, 1], turns: clockwise}", "expected 3 numbers, found 2"},
        Case{"  front left:", "  front left: {place_m: [0.2, -0.2, 0], turns: clockwards}",
             "no sense of rotation 'clockwards'"},
        Case{"  front left:", "  front left: {place_m: [0.2, -0.2, 0]}", "expected the key 'rotors.front left.turns'"},
        Case{"  front left:", "  front left: {place_m: [0.2, -0.2, 0], turns: clockwise, thrust_axis: [0, 0, 0]}",
             "expected a direction"},
        Case{"  front left:",
             "  front left: {place_m: [0.2, -0.2, 0], turns: clockwise, drive: {electric: {rotor_inertia_kgm2: 1e-4}}}",
             "'rotors.front left': it is not driven like rotor front right"},
        Case{"  front left:", "", "'rotors': multirotor: fewer than four rotors"},
        Case{
            "  front left:", "  front left: {place_m: [0.2, -0.2, 0], turns: counterclockwise, thrust_axis: [0, 0, 1]}",
            "'rotors': multirotor: "},
        Case{"  front left:", "  front left: {place_m: [-0.9, -0.9, 0], turns: clockwise}",
             "the centre of mass lies outside them"},
        Case{"drag:", "drag: {linear_nspm: -1}", "'drag.linear_nspm': expected a number from 0"},
        Case{"ground_effect:", "ground_effect: cheesman",
             "no ground effect 'cheesman'; known are none, cheeseman_bennett"},
        Case{"ground_effect:", "ground_effect: {polynomial_n: [1, 2]}", "expected 5 numbers, found 2"},
        Case{"ground_effect:", "battery: {capacity_ah: 5000, resistance_ohm: 0.02, cells: 6}", "is it in mA h?"},
        Case{"ground_effect:", "battery: {capacity_ah: 5, resistance_ohm: 0.02}", "'battery.cells': expected it, or"},
        Case{"ground_effect:", "battery: {capacity_ah: 5, resistance_ohm: 0.02, cells: 60}", "expected 1 to 24"},
        Case{"ground_effect:",
             "battery: {capacity_ah: 5, resistance_ohm: 0.02, open_circuit: [{charge_share: 0.5, "
             "voltage_v: 20}]}",
             "'battery.open_circuit': expected voltages for shares of charge from 0 to 1"},
        Case{"kind:", "kind: helicopter", "expected fixed_wing or multirotor, found 'helicopter'"},
        Case{"kind:", "", "expected the key 'kind'"},
        Case{"drag:", "darg: {}", "unknown key 'darg'; did you mean 'drag'?"}}) {
    const std::string said = message(changed(c.key, c.line));
    EXPECT_TRUE(has(said, c.expected)) << c.line << "\n" << said;
    EXPECT_TRUE(said.starts_with("vehicle.yaml:")) << said;
    EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 0) << "one fault is one line\n" << said;
  }
}

TEST(MultirotorFile, WhatCannotBeTogetherIsNamed) {
  const auto expect = [](const std::string& text, const char* part) {
    EXPECT_TRUE(has(message(text), part)) << text << "\n" << message(text);
  };
  const std::string battery = "battery: {cells: 4, capacity_ah: 5, resistance_ohm: 0.02}\n";
  expect("base: multirotor_sil\n" + battery, "'battery': a battery needs electric motors, and rotors are driven by");
  expect("base: multirotor_lumped\n" + battery, "'battery': a battery needs electric motors, and rotors are lumped");
  expect("base: multirotor\nlumped: {max_thrust_n: 30}\n", "expected the key 'lumped.max_moment_nm'");
  expect("base: multirotor_lumped\ndrive: {electric: {}}\n", "'drive': expected none, since rotors are lumped");
  expect("base: multirotor\nkind: fixed_wing\n", "expected multirotor, which the vehicle is that it changes");
  expect("base: multirotr\nmass_kg: -1\nrotors: {}\n", "did you mean 'multirotor'?");
  expect("base: multirotr\nmass_kg: -1\nrotors: {}\n", "vehicle.yaml:2: 'mass_kg'");
  expect("base: multirotor\nwing: {span_m: 2}\n", "unknown key 'wing'");
  expect("kind: multirotor\nmass_kg: 2\ninertia_kgm2: {jxx: 0.1, jyy: 0.1, jzz: 0.1}\n", "expected the key 'rotors'");
  expect("base: multirotor\ndrive: {pulse: {radius_m: 0.1}}\n", "expected the key 'drive.pulse.thrust_n'");
  std::string many = "base: multirotor\nrotors:\n";
  for (int i = 0; i < 13; ++i) many += "  r" + std::to_string(i) + ": {place_m: [0, 0, 0], turns: clockwise}\n";
  expect(many, "vehicle.yaml:2: 'rotors': expected 1 to 16 rotors, found 17");
}

TEST(MultirotorFile, AllFaultsAreInOneMessageWithTheirLines) {
  std::string text = changed("mass_kg:", "mass_kg: -3");
  text = with(text, "    diameter_m:", "    diameter_m: 381");
  text = with(text, "  rear left:", "  rear left: {place_m: [0, 0, 0], tuns: clockwise}");
  text = with(text, "ground_effect:", "ground_effect: none\nbattery: {capacity_ah: -2}");
  const std::string said = message(text);
  for (const char* part :
       {"vehicle.yaml:6: 'mass_kg'", "vehicle.yaml:10: 'drive.electric.diameter_m'",
        "vehicle.yaml:20: expected the key 'rotors.rear left.turns'",
        "vehicle.yaml:20: unknown key 'rotors.rear left.tuns'; did you mean 'turns'?",
        "vehicle.yaml:24: 'battery.capacity_ah'", "vehicle.yaml:24: expected the key 'battery.resistance_ohm'"})
    EXPECT_TRUE(has(said, part)) << part << "\n" << said;
}

TEST(MultirotorFile, UnusualOnesAreWarnedOf) {
  for (const char* name : models) {
    const auto warnings = vehicle_warnings(multirotor_model(name).value());
    EXPECT_TRUE(warnings.empty()) << name << ": " << warnings[0];
  }
  const auto warning = [](const std::string& text) {
    const auto warnings = vehicle_warnings(multirotor("base: multirotor\n" + text));
    EXPECT_EQ(warnings.size(), 1u) << text;
    return warnings.empty() ? "" : warnings[0];
  };
  const auto expect = [&](const std::string& text, const char* part) {
    EXPECT_TRUE(has(warning(text), part)) << warning(text);
  };
  expect("mass_kg: 15", "cannot hover at sea level: ");
  expect("mass_kg: 11", "little thrust: it cannot lift 1.5 times its weight, and hovers at a throttle of 0.8");
  expect("rotors: {front left: {place_m: [0.1, -0.1, 0]}}", "lopsided: it hovers at throttles of");
  const auto battery = [](int cells, double resistance_ohm) {
    return fmt::format("battery: {{cells: {}, capacity_ah: 5, resistance_ohm: {}}}", cells, resistance_ohm);
  };
  EXPECT_TRUE(vehicle_warnings(multirotor("base: multirotor\n" + battery(6, 0.02))).empty());
  expect(battery(12, 0.02), "its full battery has 50.4 V, and its motors are for 24 V");
  expect(
      "battery: {capacity_ah: 5, resistance_ohm: 0.02, open_circuit: [{charge_share: 0, voltage_v: 2}, {charge_share: "
      "0.5, voltage_v: 24}, {charge_share: 1, voltage_v: 25}]}",
      "cannot hover on the last 20 % of its battery");
}

TEST(MultirotorFile, CutOrSpoiltAnywhereItIsReadOrRefused) {
  std::mt19937 random(1);
  for (const char* name : models) {
    // Without comments, so that what is spoilt counts
    const std::string good = to_yaml(multirotor_model(name).value());
    for (std::size_t length = 0; length < good.size(); length += 7) message(good.substr(0, length));
    int refused = 0;
    for (int i = 0; i < 700; ++i) {
      std::string text = good;
      for (int k = 0; k < 2; ++k)
        text[std::uniform_int_distribution<std::size_t>(0, text.size() - 1)(random)] =
            static_cast<char>(std::uniform_int_distribution<int>(' ', '~')(random));
      const auto vehicle = parse_vehicle("spoilt", text);
      refused += !vehicle;
      if (!vehicle) continue;
      (void)vehicle_warnings(*vehicle);
      EXPECT_TRUE(parse_vehicle("again", to_yaml(*vehicle))) << text;
    }
    EXPECT_GT(refused, 100);
    EXPECT_LT(refused, 700);
  }
}

}  // namespace
}  // namespace nadir::sim
