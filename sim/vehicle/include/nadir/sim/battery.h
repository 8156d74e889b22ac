#pragma once

#include <vector>

#include "nadir/sim/parameter_fault.h"

namespace nadir::sim {

/// A battery: a voltage that falls with its charge, behind a resistance.
struct Battery {
  /// Open-circuit voltage at a share of the charge.
  struct Point {
    double charge_share = 0, voltage_v = 0;
    friend bool operator==(const Point&, const Point&) = default;
  };
  std::vector<Point> open_circuit;  // shares rise from 0 to 1; linear between
  double capacity_ah = 0;
  double resistance_ohm = 0;
  double other_current_a = 0;  // what else it feeds
};

/// Lithium-polymer cells in series: 4.20 V each when full, 3.70 V at a third, 3.27 V empty.
/// Source: a typical discharge curve at low current, rounded to 10 mV.
Battery lithium_polymer(int cells, double capacity_ah, double resistance_ohm);

/// What is wrong with the numbers, each fault on its own.
std::vector<ParameterFault> faults_of(const Battery& battery);

/// None once the charge is gone.
double open_circuit_v(const Battery& battery, double charge_ah);

}  // namespace nadir::sim
