#pragma once

#include <fmt/format.h>

#include <optional>
#include <string_view>
#include <utility>

#include "nadir/base/yaml.h"

namespace nadir::sim {

/// Takes a key's value into `out` where it is there.
template <class T>
void take(std::optional<T> value, T& out) {
  if (value) out = std::move(*value);
}

/// A text that `parse` understands, noted as a fault where it does not.
template <class T, class Parse>
std::optional<T> parsed(const YamlMap& map, std::string_view key, Parse&& parse) {
  const auto text = map.text(key);
  return text ? map.value_of<T>(key, parse(*text)) : std::nullopt;
}

inline std::optional<double> positive(const YamlMap& map, std::string_view key) {
  const auto value = map.number(key);
  if (value && !(*value > 0)) map.fault(key, fmt::format("expected a positive number, found {}", *value));
  return value;
}

inline void take_positive(const YamlMap& map, std::string_view key, double& out) { take(positive(map, key), out); }

/// `least` and `most` are allowed.
inline void take_within(const YamlMap& map, std::string_view key, double least, double most, double& out) {
  const auto value = map.number(key);
  if (value && !(*value >= least && *value <= most))
    map.fault(key, fmt::format("expected a number from {} to {}, found {}", least, most, *value));
  take(value, out);
}

}  // namespace nadir::sim
