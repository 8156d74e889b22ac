#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "nadir/base/yaml.h"
#include "nadir/geodesy/height.h"
#include "nadir/sim/mission_setup.h"
#include "nadir/sim/multirotor.h"

namespace nadir::sim {

struct BatterySetup {
  std::int64_t cells = 6;
  double capacity_ah = 10, resistance_ohm = 0.02, charge_share = 1;
};

/// What a run file says of a multirotor beyond what it says of every vehicle.
struct MultirotorSetup {
  double speed_mps = 5, climb_mps = 2, descent_mps = 1.5, acceleration_mps2 = 2;
  bool face_along = false, land = false;
  double take_off_height_m = 3, landing_mps = 0.5;
  std::optional<BatterySetup> battery;
};

constexpr std::array<std::string_view, 3> multirotor_models = {"multirotor", "multirotor_sil", "multirotor_lumped"};
bool is_multirotor(std::string_view model);

/// A model's published parameters, with what the setup adds. `model`: one of them.
Multirotor multirotor_of(std::string_view model, const MultirotorSetup& setup);

/// Of a vehicle's map; notes faults in it.
MultirotorSetup read_multirotor(const YamlMap& vehicle);

/// Lines of a vehicle, complete with defaults.
std::string multirotor_text(const MultirotorSetup& setup);

}  // namespace nadir::sim
