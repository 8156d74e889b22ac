#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/bench/row.h"

namespace nadir::bench {

/// 4 digits, without exponent where it is between 0.001 and 1e6: "0.0123", "12.35", "1235".
std::string short_number(double value);

/// The rows for a terminal, a block a case: times, rate, error, memory, and each ratio beside its aim:
/// "0.71x gdal (aim 0.85x) ok".
std::string to_table(const std::vector<Row>& rows);

struct ReportInfo {
  std::string command;                                       // how to get it again
  std::vector<std::pair<std::string, std::string>> machine;  // of `machine()`
};

/// A picture that belongs to a suite, as gnuplot takes it.
struct Picture {
  std::string suite, name, title;  // name: of its files, without ending
  std::string script;              // behind the choice of terminal and output
  int height_px, width_px = 1100;
};

/// What the rows show: of each case with errors a scatter of error against time with its Pareto front, and one more for
/// each counter `error:NAME`, and apart those of each value of the counter `front`; of each line a quantity against
/// size, of each suite its ratios as bars.
std::vector<Picture> pictures(const std::vector<Row>& rows);

/// Writes results.csv, each picture as PNG and SVG, and report.html, which needs no other file, into a folder.
/// Gives a warning, for people, where gnuplot is not installed: then there are no pictures.
Result<std::string> write_report(const std::vector<Row>& rows, const ReportInfo& info,
                                 const std::filesystem::path& folder);

}  // namespace nadir::bench
