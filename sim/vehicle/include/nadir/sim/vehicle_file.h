#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/base/yaml.h"
#include "nadir/sim/fixed_wing.h"
#include "nadir/sim/multirotor.h"

namespace nadir::sim {

/// A vehicle of any kind that parameter files describe. `kind:` in them: fixed_wing, multirotor.
using VehicleParameters = std::variant<FixedWing, Multirotor>;

/// Names of the models that come with the program, in the order of the alphabet.
std::vector<std::string_view> vehicle_models();

/// One of them: "aerosonde". Fails where there is none of that name, and proposes the nearest; those for one kind fail
/// where it is of another.
Result<VehicleParameters> vehicle_model(std::string_view name);
Result<FixedWing> fixed_wing_model(std::string_view name);
Result<Multirotor> multirotor_model(std::string_view name);

/// A vehicle from a map of parameters. Either all of them, as the files of shipped models have them; or `base`, the
/// name of one of those, or `file`, such a file (relative to `folder`), with what differs from it. Notes faults in
/// `yaml`; where it has any, what is given is of the kind that it seems to be and not to be flown.
VehicleParameters read_vehicle(const YamlMap& yaml, const std::filesystem::path& folder);

/// From a file, which may have a `base`, but no `file`. All faults are in one message, each with its line.
Result<VehicleParameters> read_vehicle_file(const std::filesystem::path& path);
Result<VehicleParameters> parse_vehicle(const std::string& file_name, const std::string& text);

/// The section of a battery, upon one where there is one: `cells` or `open_circuit`, `capacity_ah`, `resistance_ohm`,
/// `other_current_a`. Notes faults.
void read_battery(const YamlMap& yaml, std::optional<Battery>& battery);
/// As it takes it, without braces.
std::string battery_text(const Battery& battery);

/// What is unusual but can be: one line each, such as an aircraft that is not stable.
std::vector<std::string> vehicle_warnings(const VehicleParameters& vehicle);

/// All parameters, as `read_vehicle` takes them back to the same bits; each line begins with `indent`.
std::string to_yaml(const VehicleParameters& vehicle, std::string_view indent = "");

}  // namespace nadir::sim
