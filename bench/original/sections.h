#pragma once

#include <filesystem>
#include <string>

namespace nadir::bench {

// Each part of the page as Markdown; `work` is a folder for maps made on the way.

/// Metres on the ground as either publishes and shows them, beside the geodesic.
std::string scale_section(const std::filesystem::path& work);

/// Error and flicker at a minification of 3.8; draws `picture`.
std::string aliasing_section(const std::filesystem::path& work, const std::filesystem::path& picture);

/// Memory and time on a map as large as the paper's.
std::string cost_section(const std::filesystem::path& work);

/// Frames of a flight that leaves the map.
std::string border_section();

/// One method on one map in this process, for `cost_section`, which starts the program anew for each: a line of
/// numbers.
int measure_cost(const std::string& method, const std::string& map, int view, int threads);

}  // namespace nadir::bench
