#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "nadir/base/result.h"
#include "nadir/pyramid/check.h"

namespace nadir::app {

/// What checking a map found, for people.
void print_check(const pyramid::CheckReport& report);
nlohmann::ordered_json check_to_json(const pyramid::CheckReport& report);

/// Damaged where there are faults.
Result<void> outcome(const std::string& map, const pyramid::CheckReport& report);

}  // namespace nadir::app
