#pragma once

#include <string>
#include <utility>
#include <vector>

#include "nadir/base/yaml.h"
#include "nadir/sim/gain_design.h"

namespace nadir::sim {

/// `autopilot:` of a fixed wing in a run file: what differs from the gains that follow from its derivatives.
struct AutopilotSetup {
  Control control = Control::SuccessiveLoops;
  std::vector<std::pair<std::string, double>> gains;  // by their names; those of paths among them
  bool fly_unstable = false;                          // else gains whose loops are unstable are an error

  void apply(FlightGains& gains) const;
};

/// Notes faults in `yaml`.
AutopilotSetup read_autopilot(const YamlMap& yaml);

/// The section on one line, as `read_autopilot` takes it back.
std::string autopilot_text(const AutopilotSetup& setup);

}  // namespace nadir::sim
