#include "nadir/sim/autopilot_setup.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "nadir/base/text.h"
#include "read_yaml.h"

namespace nadir::sim {
namespace {

constexpr std::array<std::string_view, 2> control_names = {"successive_loops", "total_energy"};

Result<Control> parse_control(std::string_view name) { return parse_name<Control>("control", name, control_names); }

/// A gain may have either sign, and what it does is found by the modes of the loop; a limit is a positive number.
struct NamedGain {
  std::string_view name;
  double AutopilotGains::*at;
  double most = 1000;
  bool limit = false;
};
constexpr std::array gains =
    std::to_array<NamedGain>({{"roll_kp", &AutopilotGains::roll_kp},
                              {"roll_kd", &AutopilotGains::roll_kd},
                              {"pitch_kp", &AutopilotGains::pitch_kp},
                              {"pitch_kd", &AutopilotGains::pitch_kd},
                              {"yaw_damper", &AutopilotGains::yaw_damper},
                              {"course_kp", &AutopilotGains::course_kp},
                              {"height_kp", &AutopilotGains::height_kp},
                              {"climb_kp", &AutopilotGains::climb_kp},
                              {"climb_ki", &AutopilotGains::climb_ki},
                              {"airspeed_kp", &AutopilotGains::airspeed_kp},
                              {"airspeed_ki", &AutopilotGains::airspeed_ki},
                              {"acceleration_kp", &AutopilotGains::acceleration_kp},
                              {"energy_kp", &AutopilotGains::energy_kp},
                              {"energy_ki", &AutopilotGains::energy_ki},
                              {"max_roll_rad", &AutopilotGains::max_roll_rad, 1.4, true},
                              {"max_pitch_rad", &AutopilotGains::max_pitch_rad, 1.4, true},
                              {"max_climb_mps", &AutopilotGains::max_climb_mps, 100, true},
                              {"max_surface_rad", &AutopilotGains::max_surface_rad, 1.5, true}});
struct NamedPathGain {
  std::string_view name;
  double PathGains::*at;
  double most;
};
constexpr std::array path_gains = std::to_array<NamedPathGain>({{"approach_rad", &PathGains::approach_rad, 1.57},
                                                                {"line_per_m", &PathGains::line_per_m, 10},
                                                                {"circle", &PathGains::circle, 1000}});

void read_gain(const YamlMap& yaml, std::string_view name, double most, bool limit, AutopilotSetup& setup) {
  const auto value = limit ? positive(yaml, name) : yaml.number(name);
  if (!value) return;
  if (std::abs(*value) > most) yaml.fault(name, fmt::format("expected at most {}, found {}", most, *value));
  setup.gains.emplace_back(name, *value);
}

}  // namespace

void AutopilotSetup::apply(FlightGains& flight) const {
  flight.autopilot.control = control;
  for (const auto& [name, value] : gains) {
    for (const NamedGain& gain : sim::gains)
      if (gain.name == name) flight.autopilot.*gain.at = value;
    for (const NamedPathGain& gain : path_gains)
      if (gain.name == name) flight.path.*gain.at = value;
  }
}

AutopilotSetup read_autopilot(const YamlMap& yaml) {
  AutopilotSetup setup;
  take(parsed<Control>(yaml, "control", parse_control), setup.control);
  if (const auto section = yaml.map("gains")) {
    for (const NamedGain& gain : gains) read_gain(*section, gain.name, gain.most, gain.limit, setup);
    for (const NamedPathGain& gain : path_gains) read_gain(*section, gain.name, gain.most, true, setup);
  }
  take(yaml.flag("fly_unstable"), setup.fly_unstable);
  return setup;
}

std::string autopilot_text(const AutopilotSetup& setup) {
  std::string gains;
  for (const auto& [name, value] : setup.gains)
    gains += fmt::format("{}{}: {}", gains.empty() ? "" : ", ", name, value);
  return fmt::format("{{control: {}, gains: {{{}}}, fly_unstable: {}}}",
                     control_names[static_cast<std::size_t>(setup.control)], gains, setup.fly_unstable);
}

}  // namespace nadir::sim
