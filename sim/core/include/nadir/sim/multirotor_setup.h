#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nadir/base/yaml.h"
#include "nadir/sim/battery.h"
#include "nadir/sim/mission_setup.h"

namespace nadir::sim {

/// What a run file says of a multirotor beyond what it says of every vehicle.
struct MultirotorSetup {
  double speed_mps = 5, climb_mps = 2, descent_mps = 1.5, acceleration_mps2 = 2;
  bool face_along = false, land = false;
  double take_off_height_m = 3, landing_mps = 0.5;
  std::optional<Battery> battery;  // in place of the vehicle's own
  double charge_share = 1;         // of whatever battery it has, at the start
};

/// Of a vehicle's map; notes faults in it. `battery`: of the vehicle's parameters, which the map's changes.
MultirotorSetup read_multirotor(const YamlMap& vehicle, const std::optional<Battery>& battery);

/// Lines of a vehicle, complete with defaults.
std::string multirotor_text(const MultirotorSetup& setup);

}  // namespace nadir::sim
