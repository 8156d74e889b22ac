#include "work_counts.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>

#include "nadir/base/files.h"
#include "nadir/base/text.h"

namespace nadir::bench {

Result<ExpectedCounts> ExpectedCounts::read(const std::filesystem::path& path) {
  ExpectedCounts expected;
  expected.path_ = path;
  std::ifstream in(path);
  if (!in) return expected;  // nothing is expected yet
  std::string line;
  std::getline(in, line);  // the header
  for (int number = 2; std::getline(in, line); ++number) {
    const auto fields = split(line, ',');
    const auto count = fields.size() == 4 ? parse_number(fields[3]) : std::nullopt;
    if (!count)
      return fail(Error::Kind::Malformed, fmt::format("{}:{}: expected case, method, counter and count, found '{}'",
                                                      path.string(), number, line));
    expected.counts_[{std::string(fields[0]), std::string(fields[1])}][std::string(fields[2])] =
        static_cast<std::int64_t>(*count);
  }
  return expected;
}

std::string ExpectedCounts::differences(const std::string& case_name, const std::string& method,
                                        const WorkCounts& found) const {
  const auto at = counts_.find({case_name, method});
  if (at == counts_.end()) return fmt::format("nothing is expected of it yet in {}", path_.string());
  std::string text;
  for (const auto& [name, count] : found) {
    const auto expected = at->second.find(name);
    if (expected == at->second.end()) {
      text += fmt::format("{}{}: expected none, found {}", text.empty() ? "" : ", ", name, count);
      continue;
    }
    const double allowed = name == "instructions" ? 0.02 * static_cast<double>(expected->second) : 0;
    if (std::abs(static_cast<double>(count - expected->second)) > allowed)
      text += fmt::format("{}{}: expected {}, found {}", text.empty() ? "" : ", ", name, expected->second, count);
  }
  return text;
}

Result<void> ExpectedCounts::replace(const std::string& case_name, const std::string& method, const WorkCounts& found) {
  counts_[{case_name, method}] = found;
  std::string text = "case,method,counter,count\n";
  for (const auto& [key, counts] : counts_)
    for (const auto& [name, count] : counts) text += fmt::format("{},{},{},{}\n", key.first, key.second, name, count);
  return write_file(path_, text);
}

}  // namespace nadir::bench
