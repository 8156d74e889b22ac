#pragma once

#include <vector>

#include "nadir/sim/vehicle_file.h"

namespace nadir::sim {

/// On motors that follow at once; on rotors given by pulses, with lags; with rotors that are not told apart.
inline const Multirotor& quadrotor() {
  static const Multirotor vehicle = multirotor_model("multirotor").value();
  return vehicle;
}
inline const Multirotor& pulsed_quadrotor() {
  static const Multirotor vehicle = multirotor_model("multirotor_sil").value();
  return vehicle;
}
inline const Multirotor& lumped_multirotor() {
  static const Multirotor vehicle = multirotor_model("multirotor_lumped").value();
  return vehicle;
}

/// Names of the models that are fixed wings.
inline std::vector<std::string_view> fixed_wing_models() {
  std::vector<std::string_view> names = vehicle_models();
  std::erase_if(names, [](std::string_view name) { return !fixed_wing_model(name); });
  return names;
}

}  // namespace nadir::sim
