#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/base/yaml.h"
#include "nadir/sim/fixed_wing.h"

namespace nadir::sim {

/// Names of the models that come with the program, in the order of the alphabet.
std::vector<std::string_view> vehicle_models();

/// One of them: "aerosonde". Fails where there is none of that name, and proposes the nearest.
Result<FixedWing> vehicle_model(std::string_view name);

/// A vehicle from a map of parameters. Either all of them, as the files of shipped models have them; or `base`, the
/// name of one of those, or `file`, such a file (relative to `folder`), with what differs from it. Notes faults in
/// `yaml`, and gives nothing where it has any.
std::optional<FixedWing> read_vehicle(const YamlMap& yaml, const std::filesystem::path& folder);

/// From a file, which may have a `base`, but no `file`. All faults are in one message, each with its line.
Result<FixedWing> read_vehicle_file(const std::filesystem::path& path);
Result<FixedWing> parse_vehicle(const std::string& file_name, const std::string& text);

/// What is unusual but can be: one line each, such as an aircraft that is not stable.
std::vector<std::string> vehicle_warnings(const FixedWing& vehicle);

/// All parameters, as `read_vehicle` takes them back to the same bits; each line begins with `indent`.
std::string to_yaml(const FixedWing& vehicle, std::string_view indent = "");

}  // namespace nadir::sim
