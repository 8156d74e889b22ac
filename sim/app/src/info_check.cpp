#include "info_check.h"

#include <fmt/format.h>

#include "nadir/base/text.h"

namespace nadir::app {

void print_check(const pyramid::CheckReport& report) {
  const bool compared = !report.reduction.empty() && !report.bound.empty();
  fmt::print("check, in {:.1f} s: {}\n", report.seconds, report.fault_count == 0 ? "no fault found" : "faults found");
  if (compared)
    fmt::print("  a level may differ from what the one before gives by {}: {}\n", report.reduction, report.bound);
  fmt::print("  level         texels    tiles    empty  damaged      packed{}\n",
             compared ? "   difference RMS, greatest" : "");
  for (std::size_t k = 0; k < report.levels.size(); ++k) {
    const pyramid::LevelCheck& level = report.levels[k];
    fmt::print("  {:>5} {:>14} {:>8} {:>8} {:>8} {:>11}{}\n", k,
               fmt::format("{} x {}", level.size.width, level.size.height), level.tiles, level.empty_tiles,
               level.damaged_tiles, format_bytes(level.bytes),
               level.compared ? fmt::format("   {:.4g}, {:.4g}", level.rms, level.greatest) : "");
  }
  for (const std::string& note : report.notes) fmt::print("note: {}\n", note);
  constexpr std::size_t most = 20;
  for (std::size_t i = 0; i < std::min(most, report.faults.size()); ++i) fmt::print("fault: {}\n", report.faults[i]);
  if (report.fault_count > static_cast<std::int64_t>(most))
    fmt::print("... and {} more; --json tells the first thousand\n",
               report.fault_count - static_cast<std::int64_t>(most));
}

nlohmann::ordered_json check_to_json(const pyramid::CheckReport& report) {
  using Json = nlohmann::ordered_json;
  Json levels = Json::array();
  for (const pyramid::LevelCheck& level : report.levels) {
    Json one = {{"width", level.size.width},        {"height", level.size.height},          {"tiles", level.tiles},
                {"empty_tiles", level.empty_tiles}, {"damaged_tiles", level.damaged_tiles}, {"bytes", level.bytes}};
    if (level.compared) {
      one["difference_rms"] = level.rms;
      one["difference_greatest"] = level.greatest;
      one["different_texels"] = level.different;
    }
    levels.push_back(std::move(one));
  }
  return {{"cloud_optimized", report.cloud_optimized},
          {"reduction", report.reduction},
          {"bound", report.bound},
          {"levels", levels},
          {"fault_count", report.fault_count},
          {"faults", report.faults},
          {"notes", report.notes},
          {"seconds", report.seconds}};
}

Result<void> outcome(const std::string& map, const pyramid::CheckReport& report) {
  if (report.fault_count == 0) return {};
  return fail(Error::Kind::Damaged, fmt::format("{}: {} {}; the first: {}", map, report.fault_count,
                                                report.fault_count == 1 ? "fault" : "faults", report.faults.front()));
}

}  // namespace nadir::app
