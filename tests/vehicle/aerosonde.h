#pragma once

#include "nadir/sim/vehicle_file.h"

namespace nadir::sim {

/// The model that most tests fly.
inline const FixedWing& aerosonde() {
  static const FixedWing vehicle = fixed_wing_model("aerosonde").value();
  return vehicle;
}

}  // namespace nadir::sim
