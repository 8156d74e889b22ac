// Any bytes as a vehicle's parameters: either an error, or a vehicle with a steady flight or a reason for none.
#include <cmath>
#include <cstdint>
#include <string>

#include "nadir/sim/trim.h"
#include "nadir/sim/vehicle_file.h"

using namespace nadir::sim;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto vehicle = parse_vehicle("fuzz", std::string(reinterpret_cast<const char*>(data), size));
  if (!vehicle) return 0;
  const auto steady = trim(*vehicle, {.airspeed_mps = vehicle->cruise_mps}, 1.2, 9.81);
  if (steady && !std::isfinite(steady->alpha_rad)) __builtin_trap();
  if (!parse_vehicle("again", to_yaml(*vehicle))) __builtin_trap();
  return 0;
}
