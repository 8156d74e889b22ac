#include <fmt/format.h>

#include "nadir/sim/vehicle_file.h"
#include "parameter_sections.h"

namespace nadir::sim {
namespace {

constexpr int most_cells = 24;
constexpr ParameterRange capacity_range = {0, 1000, true, "is it in mA h?"}, share_range = {0, 1},
                         resistance_range = {0, 10, false, "is it in milliohms?"};

}  // namespace

void read_battery(const YamlMap& yaml, std::optional<Battery>& battery) {
  const std::size_t before = yaml.fault_count();
  const ParameterLayer layer(yaml, !battery);
  Battery b = battery.value_or(Battery{});
  layer.number("capacity_ah", capacity_range, b.capacity_ah);
  layer.number("resistance_ohm", resistance_range, b.resistance_ohm);
  layer.optional_number("other_current_a", current_range, b.other_current_a);
  if (const auto cells = yaml.integer("cells")) {
    if (yaml.has("open_circuit")) yaml.fault("open_circuit", "expected it or cells, found both");
    if (*cells < 1 || *cells > most_cells)
      yaml.fault("cells", fmt::format("expected 1 to {}, found {}", most_cells, *cells));
    else
      b.open_circuit = lithium_polymer(static_cast<int>(*cells), 0, 0).open_circuit;
  }
  if (yaml.has("open_circuit")) {
    b.open_circuit.clear();
    for (const YamlMap& point : yaml.maps("open_circuit")) {
      const ParameterLayer numbers(point, true);
      b.open_circuit.emplace_back();
      numbers.number("charge_share", share_range, b.open_circuit.back().charge_share);
      numbers.number("voltage_v", voltage_range, b.open_circuit.back().voltage_v);
    }
  }
  if (b.open_circuit.empty() && yaml.fault_count() == before)
    yaml.fault("cells", "expected it, or open_circuit: a battery has a voltage");
  note_faults(yaml, before, faults_of(b));
  battery = b;
}

std::string battery_text(const Battery& battery) {
  std::string voltage;
  for (int cells = 1; cells <= most_cells && voltage.empty(); ++cells)
    if (battery.open_circuit == lithium_polymer(cells, 0, 0).open_circuit) voltage = fmt::format("cells: {}", cells);
  if (voltage.empty()) {
    for (const Battery::Point& point : battery.open_circuit)
      voltage += fmt::format("{}{{charge_share: {}, voltage_v: {}}}", voltage.empty() ? "" : ", ", point.charge_share,
                             point.voltage_v);
    voltage = "open_circuit: [" + voltage + "]";
  }
  return fmt::format("{}, capacity_ah: {}, resistance_ohm: {}, other_current_a: {}", voltage, battery.capacity_ah,
                     battery.resistance_ohm, battery.other_current_a);
}

}  // namespace nadir::sim
