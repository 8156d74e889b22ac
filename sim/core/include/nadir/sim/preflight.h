#pragma once

#include <string>
#include <vector>

#include "nadir/sim/run.h"

namespace nadir::sim {

/// Something about a run that its vehicles will meet.
struct PreflightFinding {
  bool impossible = false;  // else doubtful
  std::string message;      // with file, line and item of the mission
};

/// Looks at the planned paths of a run before it is flown: what `check_plan` finds, in the wind of the run's beginning;
/// airspeeds that a fixed wing has no steady flight at; winds and gusts as fast as the airspeed; a multirotor's battery
/// that does not last; exposures along the path that leave the map; rates of sensors too low for their survey, runs too
/// short for one or for the landing, and runs that go on for long after the mission. Vehicles in order,
/// and their missions' items. Fails where a map of wind cannot be read.
Result<std::vector<PreflightFinding>> preflight(const Run& run);

/// All messages, one a line, of the impossible or of the doubtful; empty where there are none.
std::string preflight_text(const std::vector<PreflightFinding>& findings, bool impossible);

}  // namespace nadir::sim
