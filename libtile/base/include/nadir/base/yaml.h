#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "nadir/base/result.h"

namespace nadir {

/// A map in a YAML file that people write, read with every key checked.
///
/// Each getter names a key that may be there; what is there and was never asked for is a fault, reported with the
/// nearest name that was. Getters give nothing where the key is missing; where its value is of the wrong kind they note
/// a fault too. `finish` tells all faults of the file at once, in the order of their lines. Copies and sub-maps share
/// the file's list of faults. One thread at a time.
class YamlMap {
 public:
  /// `file` is for messages.
  static Result<YamlMap> parse(const std::string& file, const std::string& text);

  bool has(std::string_view key) const;
  bool is_map(std::string_view key) const;  // what `map` gives, or a single value?
  /// Notes a fault where the key is missing.
  void require(std::string_view key) const;

  std::optional<std::string> text(std::string_view key) const;
  std::optional<double> number(std::string_view key) const;  // finite
  std::optional<std::int64_t> integer(std::string_view key) const;
  std::optional<bool> flag(std::string_view key) const;
  std::optional<std::vector<double>> numbers(std::string_view key) const;
  std::optional<std::vector<std::string>> texts(std::string_view key) const;
  std::optional<YamlMap> map(std::string_view key) const;
  std::vector<YamlMap> maps(std::string_view key) const;         // a list of maps
  std::vector<std::pair<std::string, YamlMap>> entries() const;  // of a map whose keys users choose

  /// For messages about it that come later: where it begins, and its keys from the top of the file ("vehicles.plane1").
  int line() const;
  const std::string& name() const;

  /// Notes what is wrong with the value of a key.
  void fault(std::string_view key, const std::string& message) const;
  /// Takes a parsed value, or notes what is wrong with it.
  template <class T>
  std::optional<T> value_of(std::string_view key, Result<T> parsed) const {
    if (parsed) return std::move(*parsed);
    fault(key, parsed.error().message);
    return std::nullopt;
  }

  /// How many faults are noted so far, in the whole file.
  std::size_t fault_count() const;

  /// Error::Malformed with all faults of the file, unknown keys included.
  Result<void> finish() const;

 private:
  struct File;
  struct Node;
  YamlMap(std::shared_ptr<File> file, std::shared_ptr<Node> node) : file_(std::move(file)), node_(std::move(node)) {}
  std::shared_ptr<File> file_;
  std::shared_ptr<Node> node_;
};

/// A text as YAML takes it back, in double quotes.
std::string yaml_quoted(const std::string& text);

}  // namespace nadir
