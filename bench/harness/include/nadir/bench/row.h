#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "nadir/base/result.h"

namespace nadir::bench {

/// What was found out about one method on one case: a line of results.csv. What was not measured is empty.
struct Row {
  std::string suite, case_name, method, setting;
  std::optional<double> error;
  std::string error_unit;
  std::optional<double> cpu_ms, wall_ms;        // medians over rounds, of one repetition; CPU of all threads
  std::optional<std::uint64_t> peak_bytes;      // memory that the method took beyond what was there before it
  std::map<std::string, std::string> counters;  // none holds ';', values no '='
  std::string commit;
  friend bool operator==(const Row&, const Row&) = default;
};

/// The counter as a number, where it is one.
std::optional<double> counter(const Row& row, const std::string& key);

/// A file with a header, quoted as RFC 4180 says, lines ended by '\n'. Numbers read back as the same bits.
std::string to_csv(const std::vector<Row>& rows);

/// `file` is for messages: Error::Malformed names the line and column.
Result<std::vector<Row>> from_csv(const std::string& file, std::string_view text);

/// Rows of several files, in order.
Result<std::vector<Row>> read_csv(const std::vector<std::filesystem::path>& paths);

}  // namespace nadir::bench
