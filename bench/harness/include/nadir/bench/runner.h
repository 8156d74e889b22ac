#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/bench/measure.h"
#include "nadir/bench/row.h"

namespace nadir::bench {

enum class Cost { wall, cpu, peak };

/// Places a case, or a method of it, on an axis: those of the same line become points of one picture.
struct Point {
  std::string line;   // "opening a map"
  double x = 0;       // > 0
  std::string label;  // of the axis, with its unit: "side of the map, texels"
};

/// One way to do the work of a case.
struct Method {
  std::string name;
  std::string setting;                  // of what it was run with: "threads=2"
  std::function<Result<void>()> run;    // one repetition, measured
  std::function<Result<Usage>()> told;  // instead of `run`: one repetition, and what it took as it tells itself
  std::vector<std::string> command;     // instead of both: a program and its arguments, started for each repetition
  std::vector<std::vector<std::string>> then;   // programs that are started behind `command`, one after the other
  std::function<Result<void>()> before, after;  // each repetition, not measured; optional
  std::function<Result<double>()> error;        // asked once, after the last round; optional
  std::function<std::map<std::string, std::string>()> counters;  // likewise
  std::optional<Point> point;  // its own: methods of one name, whatever their setting, are joined by a line
  bool peak = false;     // of `run`: measure its peak memory, in a process of its own. Commands always tell theirs
  std::string left_out;  // why it cannot take part here: it is not run, and its row says so
};

/// What a method is called among the others: its name, and behind a comma its setting where it has one.
std::string label(const std::string& name, const std::string& setting);

/// A counter's value: on one line, without what separates counters.
std::string as_counter(std::string text);

/// "`method` takes at most `most` times what `baseline` takes."
struct Aim {
  std::string method, baseline;  // labels of methods of the comparison
  std::optional<double> most;    // nothing: only of interest
  Cost cost = Cost::wall;
  std::string what = {};    // of several that two methods have: told behind the baseline
  std::string missed = {};  // why it is missed whatever the ratio: the two do not do the same work
};

/// Methods that do the same work.
struct Comparison {
  std::vector<Method> methods;
  std::string error_unit;
  double work = 0;        // of one repetition, for rates; 0: no rate
  std::string work_unit;  // "MB"
  std::vector<Aim> aims;
  std::function<std::vector<Aim>(const std::vector<Row>&)> aims_of;  // further ones, which hang on what was found
  /// Makes a picture in the folder `RunOptions::pictures` after the last round, and gives its file's name; optional.
  std::function<Result<std::string>()> picture;
  std::optional<Point> point;                                        // of all methods that have none of their own
  bool warm_up = true;  // one repetition each that does not count; false where runs are long and `prepare` warms
  bool go_on = false;   // a method that fails gets a row that says so, and the others go on; else the case fails
  int rounds = 0;       // not 0: so many, whatever the options say
};

/// A comparison by name. `prepare` makes what the methods use (maps, cameras, peers); all of it goes when the
/// comparison is done.
struct Case {
  std::string name;
  std::function<Result<Comparison>()> prepare;
};

struct RunOptions {
  int rounds = 0;        // 0: as many as `budget_s` allows, at least 3 and at most 51
  double budget_s = 10;  // for the rounds of one case
  bool quick = false;    // suites make their inputs small, to see that all works
  std::string scratch;   // folder for files that suites make; there already
  // Of suites that make maps
  std::int64_t side = 0;  // texels, of their source; 0: what the suite takes
  int sources = 0;        // of their mosaic; 0: what the suite takes
  std::string keep;       // folder for what they make and may use again; empty: `scratch`
  bool large = false;     // cases that take many minutes too
  bool accept = false;    // of suite ci: what is found becomes what is expected
  std::string pictures;   // folder for pictures that suites make; empty: none wanted. Counter `picture` names one
};

/// A question and the cases that answer it.
struct Suite {
  std::string name;     // "read"
  std::string summary;  // one line
  std::function<std::vector<Case>(const RunOptions&)> cases;
};

/// Methods of round `round` of `methods`, by index: each round begins one later, so that none always runs in the wake
/// of the same other one.
std::vector<std::size_t> order_of_round(std::size_t methods, std::size_t round);

/// Runs all methods alternately, after one repetition each that is not measured, and gives a row for each.
/// Short methods are called several times a round, until these take 2 ms together (`calls` of the counters), unless
/// they have a `before` or `after`.
///
/// Counters: `rounds`, `calls`, `wall_min_ms`, `wall_q1_ms`, `wall_q3_ms`, `cpu_min_ms`; `rate` with `rate_unit`
/// where there is work; for each aim `ratio:BASELINE` (or `cpu_ratio:BASELINE`), the median of the rounds' ratios,
/// `aim:BASELINE` (`cpu_aim:BASELINE`) and `missed:BASELINE`; `peak_ratio:BASELINE` of peak memories; for a point
/// `picture` of the first method; `line`, `x`, `point_of` where it is the method's own, and `x_label`; and those of the method. `fault` or `left_out`,
/// with the reason, of a method without times. An Error names the method. A missed aim is none.
Result<std::vector<Row>> run_comparison(const std::string& suite, const std::string& case_name,
                                        const Comparison& comparison, const RunOptions& options);

/// Prepares and runs one case in a process of its own: neither its memory nor its threads meet the next case.
Result<std::vector<Row>> run_case(const std::string& suite, const Case& one, const RunOptions& options);

}  // namespace nadir::bench
