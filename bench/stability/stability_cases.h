#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace nadir::bench {

/// What came of an extreme case.
struct Outcome {
  bool as_expected = false;
  std::string happened;
  std::optional<double> error_px;        // of the exact chain against extended precision, backward, the greatest found
  std::optional<double> on_ground_m;     // what that is on the ground, of grazing rays
  std::optional<double> patch_error_px;  // likewise of what `map_patches` makes of it at 0.05 px
};

struct StabilityCase {
  std::string group;     // "views"
  std::string name;      // letters, digits and underscores
  std::string expected;  // for people
  /// `scratch`: a folder for the maps it makes.
  std::function<Outcome(const std::filesystem::path& scratch)> run;
  std::optional<double> grazing_rad;  // of the group "grazing": the angle between ray and ground
};

/// All of them: each is a row of `nadir bench stability` and a test.
std::vector<StabilityCase> stability_cases();

}  // namespace nadir::bench
