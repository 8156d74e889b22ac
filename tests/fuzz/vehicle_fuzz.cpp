// Any bytes as a vehicle's parameters: either an error, or a vehicle with a steady flight or a reason for none, and
// that is read back from what is written of it.
#include <cmath>
#include <cstdint>
#include <string>

#include "nadir/sim/multirotor_trim.h"
#include "nadir/sim/trim.h"
#include "nadir/sim/vehicle_file.h"

using namespace nadir::sim;

namespace {

bool finite_trim(const FixedWing& vehicle) {
  const auto steady = trim(vehicle, {.airspeed_mps = vehicle.cruise_mps}, 1.2, 9.81);
  return !steady || std::isfinite(steady->alpha_rad);
}

bool finite_trim(const Multirotor& vehicle) {
  const auto steady = trim(vehicle, {.forward_mps = 3}, 1.2, 9.81, vehicle.battery ? vehicle.battery->capacity_ah : 0);
  return !steady || (std::isfinite(steady->pitch_rad) && steady->controls.actuators.isFinite().all());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto vehicle = parse_vehicle("fuzz", std::string(reinterpret_cast<const char*>(data), size));
  if (!vehicle) return 0;
  if (!std::visit([](const auto& v) { return finite_trim(v); }, *vehicle)) __builtin_trap();
  (void)vehicle_warnings(*vehicle);
  if (!parse_vehicle("again", to_yaml(*vehicle))) __builtin_trap();
  return 0;
}
