#include "nadir/sim/parameter_layer.h"

#include <fmt/format.h>

#include <algorithm>

namespace nadir::sim {

void ParameterLayer::check(std::string_view key, const ParameterRange& range, double value) const {
  const bool inside = (range.above_least ? value > range.least : value >= range.least) && value <= range.most;
  if (inside) return;
  yaml_.fault(key,
              fmt::format("expected a number {} {} and up to {}, found {}{}{}", range.above_least ? "above" : "from",
                          range.least, range.most, value, range.hint.empty() ? "" : ": ", range.hint));
}

void ParameterLayer::optional_number(std::string_view key, const ParameterRange& range, double& out) const {
  const auto value = yaml_.number(key);
  if (!value) return;
  check(key, range, *value);
  out = *value;
}

void ParameterLayer::number(std::string_view key, const ParameterRange& range, double& out) const {
  if (complete_) yaml_.require(key);
  optional_number(key, range, out);
}

void ParameterLayer::numbers(std::string_view key, const ParameterRange& range, std::span<double> out) const {
  if (complete_) yaml_.require(key);
  const auto values = yaml_.numbers(key);
  if (!values) return;
  if (values->size() != out.size()) {
    yaml_.fault(key, fmt::format("expected {} numbers, found {}", out.size(), values->size()));
    return;
  }
  for (const double value : *values) check(key, range, value);
  std::copy(values->begin(), values->end(), out.begin());
}

std::optional<ParameterLayer> ParameterLayer::optional_section(std::string_view key) const {
  auto section = yaml_.map(key);
  if (!section) return std::nullopt;
  return ParameterLayer(std::move(*section), complete_);
}

std::optional<ParameterLayer> ParameterLayer::section(std::string_view key) const {
  if (complete_) yaml_.require(key);
  return optional_section(key);
}

}  // namespace nadir::sim
