#include "nadir/base/yaml.h"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "nadir/base/text.h"

namespace nadir {

struct YamlMap::Node {
  YAML::Node yaml;
  std::string path;                // "vehicles.plane1", for messages
  std::vector<std::string> asked;  // keys

  int line(std::string_view key = {}) const {
    if (!key.empty())
      for (const auto& entry : yaml)
        if (entry.first.Scalar() == key) return entry.first.Mark().line + 1;
    return yaml.Mark().is_null() ? 1 : yaml.Mark().line + 1;
  }
  std::string name(std::string_view key) const {
    return path.empty() ? std::string(key) : fmt::format("{}.{}", path, key);
  }

  /// The value of a key, which counts as asked for; undefined where it is missing.
  YAML::Node find(std::string_view key) {
    if (std::find(asked.begin(), asked.end(), key) == asked.end()) asked.emplace_back(key);
    for (const auto& entry : yaml)
      if (entry.first.IsScalar() && entry.first.Scalar() == key) return entry.second;
    return YAML::Node(YAML::NodeType::Undefined);
  }
};

struct YamlMap::File {
  std::string name;
  std::vector<std::pair<int, std::string>> faults;  // line, message
  std::vector<std::shared_ptr<Node>> maps;

  YamlMap add(const std::shared_ptr<File>& self, YAML::Node yaml, std::string path) {
    auto node = std::make_shared<Node>(Node{std::move(yaml), std::move(path), {}});
    maps.push_back(node);
    return YamlMap(self, std::move(node));
  }
};

namespace {

/// Where documents begin.
class DocumentStarts final : public YAML::EventHandler {
 public:
  std::vector<int> lines;
  void OnDocumentStart(const YAML::Mark& mark) override { lines.push_back(mark.line + 1); }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}
};

/// Of the first two documents, as far as there are so many. YAML::LoadAll would read on: over a stray comma it finds
/// empty documents without end.
std::vector<int> first_document_lines(const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  DocumentStarts starts;
  while (starts.lines.size() < 2 && parser.HandleNextDocument(starts)) continue;
  return starts.lines;
}

}  // namespace

Result<YamlMap> YamlMap::parse(const std::string& file_name, const std::string& text) {
  auto file = std::make_shared<File>(File{file_name, {}, {}});
  try {  // yaml-cpp reports by exception
    const std::vector<int> lines = first_document_lines(text);
    if (lines.size() > 1)
      return fail(
          Error::Kind::Malformed,
          fmt::format("{}:{}: expected one document, found another: remove the line '---'", file_name, lines[1]));
    const YAML::Node root = YAML::Load(text);
    if (!root.IsMap()) return fail(Error::Kind::Malformed, fmt::format("{}:1: expected 'key: value' lines", file_name));
    return file->add(file, root, "");
  } catch (const YAML::Exception& e) {
    return fail(Error::Kind::Malformed, fmt::format("{}:{}: expected YAML: {}", file_name, e.mark.line + 1, e.msg));
  }
}

bool YamlMap::has(std::string_view key) const {
  const YAML::Node value = node_->find(key);
  return value.IsDefined() && !value.IsNull();
}

bool YamlMap::is_map(std::string_view key) const { return node_->find(key).IsMap(); }

void YamlMap::require(std::string_view key) const {
  if (!has(key)) file_->faults.emplace_back(node_->line(), fmt::format("expected the key '{}'", node_->name(key)));
}

int YamlMap::line() const { return node_->line(); }
const std::string& YamlMap::name() const { return node_->path; }

void YamlMap::fault(std::string_view key, const std::string& message) const {
  file_->faults.emplace_back(node_->line(key), fmt::format("'{}': {}", node_->name(key), message));
}

std::optional<std::string> YamlMap::text(std::string_view key) const {
  if (!has(key)) return std::nullopt;
  const YAML::Node value = node_->find(key);
  if (value.IsScalar()) return value.Scalar();
  fault(key, "expected a single value");
  return std::nullopt;
}

std::optional<double> YamlMap::number(std::string_view key) const {
  const auto value = text(key);
  if (!value) return std::nullopt;
  const auto number = parse_number(*value);
  if (!number) fault(key, fmt::format("expected a number, found '{}'", *value));
  return number;
}

std::optional<std::int64_t> YamlMap::integer(std::string_view key) const {
  const auto value = number(key);
  if (!value) return std::nullopt;
  if (*value == std::floor(*value) && std::abs(*value) < 9e15) return static_cast<std::int64_t>(*value);
  fault(key, fmt::format("expected a whole number, found {}", *value));
  return std::nullopt;
}

std::optional<bool> YamlMap::flag(std::string_view key) const {
  const auto value = text(key);
  if (!value) return std::nullopt;
  if (*value == "true" || *value == "yes" || *value == "on") return true;
  if (*value == "false" || *value == "no" || *value == "off") return false;
  fault(key, fmt::format("expected true or false, found '{}'", *value));
  return std::nullopt;
}

std::optional<std::vector<std::string>> YamlMap::texts(std::string_view key) const {
  if (!has(key)) return std::nullopt;
  const YAML::Node value = node_->find(key);
  std::vector<std::string> items;
  bool good = value.IsSequence();
  for (std::size_t i = 0; good && i < value.size(); ++i) {
    good = value[i].IsScalar();
    if (good) items.push_back(value[i].Scalar());
  }
  if (good) return items;
  fault(key, "expected a list such as [4, 3, 2]");
  return std::nullopt;
}

std::optional<std::vector<double>> YamlMap::numbers(std::string_view key) const {
  const auto items = texts(key);
  if (!items) return std::nullopt;
  std::vector<double> values;
  for (const std::string& item : *items) {
    const auto value = parse_number(item);
    if (!value) {
      fault(key, fmt::format("expected finite numbers, found '{}'", item));
      return std::nullopt;
    }
    values.push_back(*value);
  }
  return values;
}

std::optional<YamlMap> YamlMap::map(std::string_view key) const {
  if (!has(key)) return std::nullopt;
  const YAML::Node value = node_->find(key);
  if (value.IsMap()) return file_->add(file_, value, node_->name(key));
  fault(key, "expected 'key: value' lines below it");
  return std::nullopt;
}

std::vector<YamlMap> YamlMap::maps(std::string_view key) const {
  std::vector<YamlMap> items;
  if (!has(key)) return items;
  const YAML::Node value = node_->find(key);
  bool good = value.IsSequence();
  for (std::size_t i = 0; good && i < value.size(); ++i) {
    good = value[i].IsMap();
    if (good) items.push_back(file_->add(file_, value[i], fmt::format("{}[{}]", node_->name(key), i)));
  }
  if (!good) fault(key, "expected a list of maps such as [{a: 1}, {a: 2}]");
  return items;
}

std::vector<std::pair<std::string, YamlMap>> YamlMap::entries() const {
  std::vector<std::pair<std::string, YamlMap>> items;
  for (const auto& entry : node_->yaml) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "";
    if (key.empty()) {
      file_->faults.emplace_back(entry.first.Mark().line + 1, "expected a name");
    } else if (auto value = map(key)) {
      items.emplace_back(key, std::move(*value));
    } else if (!has(key)) {
      fault(key, "expected 'key: value' lines below it");
    }
  }
  return items;
}

std::size_t YamlMap::fault_count() const { return file_->faults.size(); }

Result<void> YamlMap::finish() const {
  auto faults = file_->faults;
  for (const auto& node : file_->maps) {
    const std::vector<std::string_view> known(node->asked.begin(), node->asked.end());
    std::vector<std::string> seen;
    for (const auto& entry : node->yaml) {
      const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "?";
      const int line = entry.first.Mark().line + 1;
      if (std::find(known.begin(), known.end(), key) == known.end())
        faults.emplace_back(line, fmt::format("unknown key '{}'{}", node->name(key), suggestion(key, known)));
      else if (std::find(seen.begin(), seen.end(), key) != seen.end())
        faults.emplace_back(line, fmt::format("the key '{}' is there twice", node->name(key)));
      seen.push_back(key);
    }
  }
  if (faults.empty()) return {};
  std::stable_sort(faults.begin(), faults.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  faults.erase(std::unique(faults.begin(), faults.end()), faults.end());
  std::string message;
  for (const auto& [line, text] : faults)
    message += fmt::format("{}{}:{}: {}", message.empty() ? "" : "\n", file_->name, line, text);
  return fail(Error::Kind::Malformed, message);
}

std::string yaml_quoted(const std::string& text) {
  YAML::Emitter quoted;
  quoted << YAML::DoubleQuoted << text;
  return quoted.c_str();
}

}  // namespace nadir
