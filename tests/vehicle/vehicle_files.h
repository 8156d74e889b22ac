#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <string_view>

#include "nadir/base/files.h"
#include "nadir/sim/vehicle_file.h"

namespace nadir::sim {

/// The file of a shipped model.
inline std::string model_text(std::string_view name) {
  return read_text_file(std::filesystem::path(NADIR_SOURCE_DIR) / "sim/vehicle/models" / (std::string(name) + ".yaml"))
      .value();
}

/// A text with one line's end, from `key` on, replaced: "mass_kg:" -> "mass_kg: -3".
inline std::string with(std::string text, std::string_view key, std::string_view line) {
  const auto from = text.find(key);
  EXPECT_NE(from, std::string::npos) << key;
  return text.replace(from, text.find('\n', from) - from, line);
}

/// What is said of a file: "good", or its faults.
inline std::string message(const std::string& text) {
  const auto vehicle = parse_vehicle("vehicle.yaml", text);
  return vehicle ? "good" : vehicle.error().message;
}

inline bool has(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

}  // namespace nadir::sim
