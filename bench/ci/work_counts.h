#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "nadir/base/result.h"

namespace nadir::bench {

/// What was counted, by name.
using WorkCounts = std::map<std::string, std::int64_t>;

/// Counts by case and method, as a CSV holds them: case, method, counter, count.
class ExpectedCounts {
 public:
  static Result<ExpectedCounts> read(const std::filesystem::path& path);

  /// What of `found` is not as expected, in words; empty where all is. Counts of instructions may differ by 2 %, since
  /// compilers move them about; all others not at all.
  std::string differences(const std::string& case_name, const std::string& method, const WorkCounts& found) const;

  /// Puts `found` in place of what was expected there, and writes all of it.
  Result<void> replace(const std::string& case_name, const std::string& method, const WorkCounts& found);

 private:
  std::filesystem::path path_;
  std::map<std::pair<std::string, std::string>, WorkCounts> counts_;
};

}  // namespace nadir::bench
