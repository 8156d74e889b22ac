#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "nadir/base/yaml.h"

namespace nadir::sim {

/// What a parameter can be.
struct ParameterRange {
  double least = 0, most = 0;
  bool above_least = false;    // `least` itself is none
  std::string_view hint = {};  // of what a number outside is likely to be: "is it in degrees?"
};

/// A map of a vehicle's parameters: one that gives all of them, or one that changes some of another vehicle's.
class ParameterLayer {
 public:
  ParameterLayer(YamlMap yaml, bool complete) : yaml_(std::move(yaml)), complete_(complete) {}

  /// Takes a number into `out`, or notes that it is outside its range or, where the layer is complete, missing.
  void number(std::string_view key, const ParameterRange& range, double& out) const;
  /// The same for one that may be missing.
  void optional_number(std::string_view key, const ParameterRange& range, double& out) const;
  /// As many numbers as `out` has, each in the range.
  void numbers(std::string_view key, const ParameterRange& range, std::span<double> out) const;
  std::optional<ParameterLayer> section(std::string_view key) const;
  std::optional<ParameterLayer> optional_section(std::string_view key) const;

  const YamlMap& yaml() const { return yaml_; }
  bool complete() const { return complete_; }

 private:
  void check(std::string_view key, const ParameterRange& range, double value) const;
  YamlMap yaml_;
  bool complete_;
};

}  // namespace nadir::sim
