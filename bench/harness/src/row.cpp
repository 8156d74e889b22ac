#include "nadir/bench/row.h"

#include <fmt/format.h>

#include <array>
#include <charconv>

#include "nadir/base/files.h"
#include "nadir/base/text.h"

namespace nadir::bench {
namespace {

constexpr std::array<std::string_view, 11> columns = {"suite",      "case",       "method", "setting",
                                                      "error",      "error_unit", "cpu_ms", "wall_ms",
                                                      "peak_bytes", "counters",   "commit"};

std::string csv_field(std::string_view field) {
  if (field.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(field);
  std::string out = "\"";
  for (const char c : field) out.append(c == '"' ? 2 : 1, c);
  return out + '"';
}

template <class T>
std::string number(const std::optional<T>& value) {
  return value ? fmt::format("{}", *value) : "";
}

std::string counters_text(const Row& row) {
  std::string text;
  for (const auto& [key, value] : row.counters) text += fmt::format("{}{}={}", text.empty() ? "" : ";", key, value);
  return text;
}

struct Record {
  std::size_t line;  // where it begins, from 1
  std::vector<std::string> fields;
};

/// Splits a file into records; a quoted field may hold separators and line ends.
Result<std::vector<Record>> records_of(const std::string& file, std::string_view text) {
  std::vector<Record> records;
  std::size_t line = 1, i = 0;
  while (i < text.size()) {
    Record record{line, {""}};
    for (bool quotes = false;; ++i) {
      if (i == text.size()) {
        if (quotes)
          return fail(Error::Kind::Malformed,
                      fmt::format("{}: line {}: a quoted field never ends; is the file cut?", file, record.line));
        break;
      }
      const char c = text[i];
      line += c == '\n';
      std::string& field = record.fields.back();
      if (quotes && c == '"' && i + 1 < text.size() && text[i + 1] == '"') {
        field += '"';
        ++i;
      } else if (c == '"' && (quotes || field.empty())) {
        quotes = !quotes;
      } else if (!quotes && c == ',') {
        record.fields.emplace_back();
      } else if (!quotes && c == '\n') {
        ++i;
        break;
      } else if (quotes || c != '\r') {
        field += c;
      }
    }
    records.push_back(std::move(record));
  }
  return records;
}

tl::unexpected<Error> bad_field(const std::string& file, std::size_t line, std::string_view column,
                                std::string_view found, std::string_view expected) {
  return fail(Error::Kind::Malformed,
              fmt::format("{}: line {}: {} is '{}', expected {}", file, line, column, found, expected));
}

Result<Row> row_of(const std::string& file, const Record& record) {
  const auto& f = record.fields;
  if (f.size() != columns.size())
    return fail(Error::Kind::Malformed,
                fmt::format("{}: line {}: expected {} fields, found {}", file, record.line, columns.size(), f.size()));
  Row row{.suite = f[0], .case_name = f[1], .method = f[2], .setting = f[3], .error_unit = f[5], .commit = f[10]};
  for (const auto& [column, value] : {std::pair{4, &row.error}, {6, &row.cpu_ms}, {7, &row.wall_ms}}) {
    const std::string& field = f[static_cast<std::size_t>(column)];
    if (field.empty()) continue;
    *value = parse_number(field);
    if (!*value)
      return bad_field(file, record.line, columns[static_cast<std::size_t>(column)], field, "a number or nothing");
  }
  if (!f[8].empty()) {
    std::uint64_t bytes = 0;
    const auto [end, problem] = std::from_chars(f[8].data(), f[8].data() + f[8].size(), bytes);
    if (problem != std::errc{} || end != f[8].data() + f[8].size())
      return bad_field(file, record.line, columns[8], f[8], "a whole number of bytes or nothing");
    row.peak_bytes = bytes;
  }
  if (!f[9].empty())
    for (const std::string_view pair : split(f[9], ';')) {
      const std::size_t equals = pair.rfind('=');
      if (equals == std::string_view::npos || equals == 0)
        return bad_field(file, record.line, columns[9], f[9], "key=value;key=value");
      row.counters[std::string(pair.substr(0, equals))] = pair.substr(equals + 1);
    }
  return row;
}

}  // namespace

std::optional<double> counter(const Row& row, const std::string& key) {
  const auto found = row.counters.find(key);
  return found == row.counters.end() ? std::nullopt : parse_number(found->second);
}

std::string to_csv(const std::vector<Row>& rows) {
  std::string text = fmt::format("{}\n", fmt::join(columns, ","));
  for (const Row& row : rows) {
    const std::array<std::string, columns.size()> fields = {
        csv_field(row.suite),   csv_field(row.case_name),      csv_field(row.method), csv_field(row.setting),
        number(row.error),      csv_field(row.error_unit),     number(row.cpu_ms),    number(row.wall_ms),
        number(row.peak_bytes), csv_field(counters_text(row)), csv_field(row.commit)};
    text += fmt::format("{}\n", fmt::join(fields, ","));
  }
  return text;
}

Result<std::vector<Row>> from_csv(const std::string& file, std::string_view text) {
  const auto records = records_of(file, text);
  if (!records) return fail(records);
  if (records->empty() ||
      !std::equal(columns.begin(), columns.end(), records->front().fields.begin(), records->front().fields.end()))
    return fail(Error::Kind::Malformed, fmt::format("{}: line 1: expected the header '{}' that `nadir bench` writes",
                                                    file, fmt::join(columns, ",")));
  std::vector<Row> rows;
  for (std::size_t i = 1; i < records->size(); ++i) {
    auto row = row_of(file, (*records)[i]);
    if (!row) return fail(row);
    rows.push_back(std::move(*row));
  }
  return rows;
}

Result<std::vector<Row>> read_csv(const std::vector<std::filesystem::path>& paths) {
  std::vector<Row> all;
  for (const auto& path : paths) {
    const auto text = read_text_file(path);
    if (!text) return fail(text);
    auto rows = from_csv(path.string(), *text);
    if (!rows) return fail(rows);
    std::move(rows->begin(), rows->end(), std::back_inserter(all));
  }
  return all;
}

}  // namespace nadir::bench
