#include "nadir/sim/multirotor_setup.h"

#include <fmt/format.h>

#include <algorithm>

#include "read_yaml.h"

namespace nadir::sim {
namespace {

BatterySetup read_battery(const YamlMap& yaml) {
  BatterySetup battery;
  if (const auto cells = yaml.integer("cells")) {
    battery.cells = *cells;
    if (*cells < 1 || *cells > 24) yaml.fault("cells", fmt::format("expected 1 to 24, found {}", *cells));
  }
  take_positive(yaml, "capacity_ah", battery.capacity_ah);
  take_within(yaml, "resistance_ohm", 0, 10, battery.resistance_ohm);
  take_within(yaml, "charge_share", 0, 1, battery.charge_share);
  return battery;
}

}  // namespace

bool is_multirotor(std::string_view model) {
  return std::find(multirotor_models.begin(), multirotor_models.end(), model) != multirotor_models.end();
}

Multirotor multirotor_of(std::string_view model, const MultirotorSetup& setup) {
  Multirotor vehicle = model == "multirotor_sil"      ? rosflight_sil_multirotor()
                       : model == "multirotor_lumped" ? roscopter_multirotor()
                                                      : rosflight_multirotor();
  if (const auto& b = setup.battery)
    vehicle.battery = lithium_polymer(static_cast<int>(b->cells), b->capacity_ah, b->resistance_ohm);
  return vehicle;
}

MultirotorSetup read_multirotor(const YamlMap& vehicle) {
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
  if (const auto battery = vehicle.map("battery")) setup.battery = read_battery(*battery);
  return setup;
}

std::string multirotor_text(const MultirotorSetup& setup) {
  std::string text = fmt::format(
      "    flight: {{speed_mps: {}, climb_mps: {}, descent_mps: {}, acceleration_mps2: {}, face_along: {}, land: {},\n"
      "      take_off_height_m: {}, landing_mps: {}}}\n",
      setup.speed_mps, setup.climb_mps, setup.descent_mps, setup.acceleration_mps2, setup.face_along, setup.land,
      setup.take_off_height_m, setup.landing_mps);
  if (const auto& b = setup.battery)
    text += fmt::format("    battery: {{cells: {}, capacity_ah: {}, resistance_ohm: {}, charge_share: {}}}\n", b->cells,
                        b->capacity_ah, b->resistance_ohm, b->charge_share);
  return text;
}

}  // namespace nadir::sim
