#include "nadir/sim/battery.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace nadir::sim {

Battery lithium_polymer(int cells, double capacity_ah, double resistance_ohm) {
  constexpr Battery::Point cell[] = {{0.00, 3.27}, {0.05, 3.61}, {0.10, 3.69}, {0.20, 3.73}, {0.35, 3.77},
                                     {0.50, 3.84}, {0.65, 3.92}, {0.80, 4.02}, {0.90, 4.11}, {1.00, 4.20}};
  Battery battery;
  for (const Battery::Point& point : cell)
    battery.open_circuit.push_back({point.charge_share, cells * point.voltage_v});
  battery.capacity_ah = capacity_ah;
  battery.resistance_ohm = resistance_ohm;
  return battery;
}

std::vector<ParameterFault> faults_of(const Battery& battery) {
  std::vector<ParameterFault> faults;
  if (!(battery.capacity_ah > 0) || !std::isfinite(battery.capacity_ah))
    faults.push_back({"capacity_ah", fmt::format("expected a capacity above 0 A h, found {}", battery.capacity_ah)});
  if (!(battery.resistance_ohm >= 0) || !std::isfinite(battery.resistance_ohm))
    faults.push_back(
        {"resistance_ohm", fmt::format("expected a resistance of 0 ohm or more, found {}", battery.resistance_ohm)});
  if (!(battery.other_current_a >= 0) || !std::isfinite(battery.other_current_a))
    faults.push_back(
        {"other_current_a", fmt::format("expected a current of 0 A or more, found {}", battery.other_current_a)});
  const auto& points = battery.open_circuit;
  if (points.size() < 2 || points.front().charge_share != 0 || points.back().charge_share != 1)
    faults.push_back({"open_circuit", "expected voltages for shares of charge from 0 to 1"});
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!(points[i].voltage_v > 0) || !std::isfinite(points[i].voltage_v))
      faults.push_back(
          {"open_circuit", fmt::format("expected a voltage above 0 V at a share of {} of the charge, found {}",
                                       points[i].charge_share, points[i].voltage_v)});
    if (i > 0 && !(points[i].charge_share > points[i - 1].charge_share))
      faults.push_back({"open_circuit", fmt::format("expected rising shares of charge, found {} after {}",
                                                    points[i].charge_share, points[i - 1].charge_share)});
  }
  return faults;
}

double open_circuit_v(const Battery& battery, double charge_ah) {
  if (!(charge_ah > 0)) return 0;
  const double share = std::min(1.0, charge_ah / battery.capacity_ah);
  const auto& points = battery.open_circuit;
  std::size_t above = 1;
  while (above + 1 < points.size() && points[above].charge_share < share) ++above;
  const Battery::Point &low = points[above - 1], &high = points[above];
  return low.voltage_v +
         (share - low.charge_share) / (high.charge_share - low.charge_share) * (high.voltage_v - low.voltage_v);
}

}  // namespace nadir::sim
