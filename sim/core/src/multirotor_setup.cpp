#include "nadir/sim/multirotor_setup.h"

#include <fmt/format.h>

#include "nadir/sim/vehicle_file.h"
#include "read_yaml.h"

namespace nadir::sim {
MultirotorSetup read_multirotor(const YamlMap& vehicle, const std::optional<Battery>& battery) {
  MultirotorSetup setup;
  if (const auto flight = vehicle.map("flight")) {
    take_positive(*flight, "speed_mps", setup.speed_mps);
    take_positive(*flight, "climb_mps", setup.climb_mps);
    take_positive(*flight, "descent_mps", setup.descent_mps);
    take_positive(*flight, "acceleration_mps2", setup.acceleration_mps2);
    take(flight->flag("face_along"), setup.face_along);
    take(flight->flag("land"), setup.land);
    take_positive(*flight, "take_off_height_m", setup.take_off_height_m);
    take_positive(*flight, "landing_mps", setup.landing_mps);
  }
  if (const auto changes = vehicle.map("battery")) {
    setup.battery = battery.value_or(lithium_polymer(6, 10, 0.02));
    read_battery(*changes, setup.battery);
    take_within(*changes, "charge_share", 0, 1, setup.charge_share);
  }
  return setup;
}

std::string multirotor_text(const MultirotorSetup& setup) {
  std::string text = fmt::format(
      "    flight: {{speed_mps: {}, climb_mps: {}, descent_mps: {}, acceleration_mps2: {}, face_along: {}, land: {},\n"
      "      take_off_height_m: {}, landing_mps: {}}}\n",
      setup.speed_mps, setup.climb_mps, setup.descent_mps, setup.acceleration_mps2, setup.face_along, setup.land,
      setup.take_off_height_m, setup.landing_mps);
  if (setup.battery)
    text += fmt::format("    battery: {{{}, charge_share: {}}}\n", battery_text(*setup.battery), setup.charge_share);
  return text;
}

}  // namespace nadir::sim
