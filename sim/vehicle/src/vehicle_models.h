#pragma once

#include <span>
#include <string_view>

namespace nadir::sim {

struct VehicleModelText {
  std::string_view name, yaml;
};

/// The files of sim/vehicle/models, compiled in, in the order of their names.
std::span<const VehicleModelText> vehicle_model_texts();

}  // namespace nadir::sim
