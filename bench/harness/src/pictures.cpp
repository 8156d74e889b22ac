#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <set>

#include "nadir/bench/report.h"
#include "nadir/bench/runner.h"
#include "nadir/bench/statistics.h"

namespace nadir::bench {
namespace {

/// A string of gnuplot in which nothing is replaced.
std::string gnuplot_string(std::string_view text) {
  std::string out = "'";
  for (const char c : text) out.append(c == '\'' ? 2 : 1, c == '\n' ? ' ' : c);
  return out + '\'';
}

/// For names of files: what is not a letter or digit becomes '-'.
std::string file_name(std::string_view text) {
  std::string out;
  for (const char c : text) out += (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ? c : '-';
  return out;
}

std::string method_name(const Row& row) { return label(row.method, row.setting); }

/// Rows by a name that each has, in the order in which names first come; rows without one are left out.
struct Group {
  std::string name;
  std::vector<Row> rows;
};
std::vector<Group> group(const std::vector<Row>& rows, const std::function<std::string(const Row&)>& name_of) {
  std::vector<Group> groups;
  for (const Row& row : rows) {
    const std::string name = name_of(row);
    if (name.empty()) continue;
    auto found = std::find_if(groups.begin(), groups.end(), [&](const Group& g) { return g.name == name; });
    if (found == groups.end()) found = groups.insert(groups.end(), {name, {}});
    found->rows.push_back(row);
  }
  return groups;
}

/// Colours that people of any colour vision tell apart. Source: Okabe and Ito, Color Universal Design, 2008.
constexpr std::array colours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"};
std::string style(std::size_t i) {
  constexpr std::array shapes = {7, 5, 9, 11, 13};  // filled circle, square, triangles, diamond
  return fmt::format("pt {} ps 1.3 lw 2 lc rgb '{}'", shapes[(i + i / colours.size()) % shapes.size()],
                     colours[i % colours.size()]);
}

constexpr auto common =
    "set border 3\nset tics nomirror out\nset grid lt 1 lw 1 lc rgb '#e0e0e0'\n"
    "set key outside right top Left reverse samplen 1.5 spacing 1.2\n";

/// Room on both sides of what is drawn on a logarithmic axis.
std::string log_range(const std::vector<double>& values) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  const double margin = std::max(1.3, std::pow(*most / *least, 0.08));
  return fmt::format("[{:.6g}:{:.6g}]", *least / margin, *most * margin);
}

/// Labels of a logarithmic axis: as many a decade as its range has room for.
std::string log_tics(char axis, const std::vector<double>& values) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  const double range = *most / *least;
  const std::vector<double> digits = range > 1000 ? std::vector<double>{1}
                                     : range > 10 ? std::vector<double>{1, 2, 5}
                                                  : std::vector<double>{1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8};
  std::string list;
  for (int power = static_cast<int>(std::floor(std::log10(*least))) - 1; power <= std::log10(*most) + 1; ++power)
    for (const double digit : digits)
      list += fmt::format("{}{:g}", list.empty() ? "" : ",", digit * std::pow(10, power));
  return fmt::format("set {}tics ({})\n", axis, list);
}

/// Whether labels of `sizes`, ascending, find room beside each other on a logarithmic axis.
bool have_room(const std::vector<double>& sizes) {
  constexpr double most_labels = 16;
  if (sizes.size() < 2) return true;
  const double room = std::log(sizes.back() / sizes.front()) / most_labels;
  return std::adjacent_find(sizes.begin(), sizes.end(), [&](double a, double b) { return std::log(b / a) < room; }) ==
         sizes.end();
}

/// Labels of sizes: the sizes themselves where they have room, large powers of two as such.
std::string size_tics(std::vector<double> sizes) {
  std::sort(sizes.begin(), sizes.end());
  sizes.erase(std::unique(sizes.begin(), sizes.end()), sizes.end());
  if (!have_room(sizes)) return log_tics('x', sizes);
  std::string list;
  for (const double size : sizes) {
    int exponent = 0;
    const bool power = std::frexp(size, &exponent) == 0.5 && size >= 16384;
    list += fmt::format("{}'{}' {:.9g}", list.empty() ? "" : ",",
                        power ? fmt::format("2^{}", exponent - 1) : fmt::format("{:g}", size), size);
  }
  return fmt::format("set xtics ({})\n", list);
}

/// `further`: name of the error among those that are counters; empty: the rows' own.
std::optional<Picture> scatter(const std::string& suite, const Group& of_case, const std::string& further) {
  std::vector<Row> rows;
  for (Row row : of_case.rows) {
    if (!further.empty()) row.error = counter(row, "error:" + further);
    if (row.error && row.wall_ms && *row.wall_ms > 0) rows.push_back(std::move(row));
  }
  std::vector<double> times, errors;
  double least_error = std::numeric_limits<double>::infinity();
  for (const Row& row : rows)
    if (*row.error > 0) least_error = std::min(least_error, *row.error);
  if (rows.size() < 2 || !std::isfinite(least_error)) return std::nullopt;

  // No error has no logarithm: it gets a line of its own below the smallest error
  const double exact = least_error / 4;
  bool any_exact = false;
  std::vector<double> shown_times;
  for (const Row& row : rows) {
    times.push_back(*row.wall_ms);
    errors.push_back(*row.error > 0 ? *row.error : exact);
    any_exact |= *row.error <= 0;
    shown_times.insert(shown_times.end(), {*row.wall_ms, counter(row, "wall_q1_ms").value_or(*row.wall_ms),
                                           counter(row, "wall_q3_ms").value_or(*row.wall_ms)});
  }
  std::string script = common;
  script += fmt::format("set logscale xy\nset xrange {}\nset yrange {}\n", log_range(shown_times), log_range(errors));
  script += log_tics('x', shown_times) + log_tics('y', errors);
  if (any_exact) script += fmt::format("set ytics add ('none' {:.6g})\n", exact);
  script += "set xlabel 'wall time of one repetition, ms (median; bars: middle half of the rounds)'\n";
  script += fmt::format("set ylabel {}\n",
                        gnuplot_string("error" + (rows[0].error_unit.empty() ? "" : ", " + rows[0].error_unit)));
  script += "$front << EOD\n";
  for (const std::size_t i : pareto_front(times, errors)) script += fmt::format("{:.9g} {:.9g}\n", times[i], errors[i]);
  script += "EOD\n";
  std::string plot = "plot $front with steps lw 2 dt 2 lc rgb '#888888' title 'Pareto front'";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    script += fmt::format("$m{} << EOD\n{:.9g} {:.9g} {:.9g} {:.9g}\nEOD\n", i, times[i], errors[i],
                          counter(rows[i], "wall_q1_ms").value_or(times[i]),
                          counter(rows[i], "wall_q3_ms").value_or(times[i]));
    plot += fmt::format(", $m{} with xerrorbars {} title {}", i, style(i), gnuplot_string(method_name(rows[i])));
  }
  return Picture{suite, file_name(suite + "-" + of_case.name + "-error" + (further.empty() ? "" : "-" + further)),
                 of_case.name + ": error" + (further.empty() ? "" : " (" + further + ")") + " against time",
                 script + plot + "\n", std::max(480, 160 + 22 * static_cast<int>(rows.size()))};
}

/// Rows of a case share a picture and its front, unless they tell of which of several they are.
std::string front_name(const Row& row) {
  const auto found = row.counters.find("front");
  return found == row.counters.end() ? row.case_name : row.case_name + ", " + found->second;
}

/// Names of the errors that rows of a case have, the first empty: their own.
std::set<std::string> further_errors(const Group& of_case) {
  const std::string prefix = "error:";
  std::set<std::string> names = {""};
  for (const Row& row : of_case.rows)
    for (const auto& [key, value] : row.counters)
      if (key.starts_with(prefix)) names.insert(key.substr(prefix.size()));
  return names;
}

struct Quantity {
  std::string name, label;
  std::function<std::optional<double>(const Row&)> of;
};

std::optional<Picture> lines(const std::string& suite, const Group& line, const Quantity& quantity) {
  const auto methods = group(line.rows, [](const Row& row) {
    const auto found = row.counters.find("point_of");
    return found == row.counters.end() ? method_name(row) : found->second;
  });
  std::string script = common, plot = "plot ", x_label;
  std::vector<double> xs, ys;
  for (std::size_t i = 0; i < methods.size(); ++i) {
    std::vector<std::pair<double, double>> points;
    for (const Row& row : methods[i].rows) {
      const auto x = counter(row, "x"), y = quantity.of(row);
      if (!x || !y || *x <= 0 || *y <= 0) continue;
      points.emplace_back(*x, *y);
      xs.push_back(*x);
      ys.push_back(*y);
      if (const auto label = row.counters.find("x_label"); label != row.counters.end()) x_label = label->second;
    }
    if (points.empty()) continue;
    std::sort(points.begin(), points.end());
    script += fmt::format("$m{} << EOD\n", i);
    for (const auto& [x, y] : points) script += fmt::format("{:.9g} {:.9g}\n", x, y);
    script += "EOD\n";
    plot += fmt::format("{}$m{} with linespoints {} title {}", plot.size() > 5 ? ", " : "", i, style(i),
                        gnuplot_string(methods[i].name));
  }
  if (xs.empty() || *std::max_element(xs.begin(), xs.end()) == *std::min_element(xs.begin(), xs.end()))
    return std::nullopt;
  script += fmt::format("set logscale xy\nset xrange {}\nset yrange {}\n", log_range(xs), log_range(ys));
  script += size_tics(xs) + log_tics('y', ys);
  script += fmt::format(
      "set xlabel {}\nset ylabel {}\n", gnuplot_string(x_label),
      gnuplot_string(quantity.label + (quantity.name == "error" ? ", " + line.rows.front().error_unit : "")));
  return Picture{suite, file_name(suite + "-" + line.name + "-" + quantity.name), line.name + ": " + quantity.name,
                 script + plot + "\n", std::max(480, 160 + 22 * static_cast<int>(methods.size()))};
}

/// The time it took against what was written, a point a case and method; what is part of a line has its own picture.
std::optional<Picture> written(const Group& suite) {
  std::vector<Row> rows;
  std::vector<double> times, sizes;
  for (const Row& row : suite.rows)
    if (const auto bytes = counter(row, "written_bytes");
        bytes && *bytes > 0 && row.wall_ms && *row.wall_ms > 0 && !row.counters.contains("line")) {
      rows.push_back(row);
      times.push_back(*row.wall_ms / 1e3);
      sizes.push_back(*bytes / 1e6);
    }
  if (rows.size() < 2) return std::nullopt;
  std::string script = common;
  script += fmt::format("set logscale xy\nset xrange {}\nset yrange {}\n", log_range(sizes), log_range(times));
  script += log_tics('x', sizes) + log_tics('y', times);
  script += "set datafile separator '|'\nset xlabel 'written, MB'\nset ylabel 'wall time, s (median)'\n";
  std::string plot = "plot ";
  const auto methods = group(rows, [](const Row& row) { return row.method; });
  for (std::size_t i = 0; i < methods.size(); ++i) {
    script += fmt::format("$m{} << EOD\n", i);
    for (const Row& row : methods[i].rows)
      script +=
          fmt::format("{:.9g}|{:.9g}|{}\n", *counter(row, "written_bytes") / 1e6, *row.wall_ms / 1e3, row.case_name);
    script += "EOD\n";
    plot += fmt::format(
        "{0}$m{1} with points {2} title {3}, $m{1} using 1:2:3 with labels left offset 0.8,0.3 font ',8' "
        "tc rgb '#888888' notitle",
        plot.size() > 5 ? ", " : "", i, style(i), gnuplot_string(methods[i].name));
  }
  return Picture{suite.name, file_name(suite.name + "-written"), suite.name + ": time against what is written",
                 script + plot + "\n", 700};
}

struct Bar {
  std::string label;
  double ratio;
  std::optional<double> aim;
};

std::optional<Picture> bars(const Group& suite) {
  std::vector<Bar> all;
  for (const Row& row : suite.rows)
    for (const auto& [key, value] : row.counters)
      for (const std::string prefix : {"ratio:", "cpu_ratio:", "peak_ratio:"})
        if (key.starts_with(prefix)) {
          const std::string baseline = key.substr(prefix.size()), kind = prefix.substr(0, prefix.find("ratio:"));
          all.push_back({fmt::format("{}: {} / {}{}", row.case_name, method_name(row), baseline,
                                     kind == "cpu_" ? " (CPU)"
                                     : kind.empty() ? ""
                                                    : " (memory)"),
                         counter(row, key).value_or(1), counter(row, kind + "aim:" + baseline)});
        }
  std::erase_if(all, [](const Bar& bar) { return !(bar.ratio > 0); });
  if (all.empty()) return std::nullopt;

  const auto count = static_cast<int>(all.size());
  std::vector<double> values = {1};
  std::array<std::string, 3> data;  // met, missed, without aim
  std::string tics, aims, labels;
  std::size_t longest = 0;
  for (int i = 0; i < count; ++i) {
    const Bar& bar = all[static_cast<std::size_t>(i)];
    const int y = count - i;
    longest = std::max(longest, bar.label.size());
    values.push_back(bar.ratio);
    tics += fmt::format("{}{} {}", tics.empty() ? "" : ", ", gnuplot_string(bar.label), y);
    data[!bar.aim                ? 2
         : bar.ratio <= *bar.aim ? 0
                                 : 1] += fmt::format("1 {} {:.6g} {:.6g} {} {}\n", y, std::min(1.0, bar.ratio),
                                                     std::max(1.0, bar.ratio), y - 0.3, y + 0.3);
    labels += fmt::format(
        "set label {} at graph 1.02,first {} left\n",
        gnuplot_string(fmt::format("{:.3g}x{}", bar.ratio, bar.aim ? fmt::format(" (aim {:.3g}x)", *bar.aim) : "")), y);
    if (bar.aim) {
      values.push_back(*bar.aim);
      aims += fmt::format("{:.6g} {} 0 0.8\n", *bar.aim, y - 0.4);
    }
  }
  std::string script = common;
  script += fmt::format("set logscale x\nset xrange {}\nset yrange [0.3:{}]\nset rmargin 20\nset lmargin {}\n",
                        log_range(values), count + 0.7, longest + 2);
  script +=
      log_tics('x', values) + fmt::format("set ytics ({})\nunset grid\nset grid x lt 1 lw 1 lc rgb '#e0e0e0'\n", tics);
  script += "set xlabel 'cost of the first over cost of the second; left of 1 it takes less'\n";
  script +=
      "set key outside top center horizontal maxrows 1 samplen 1.5\nset style fill solid 0.8 "
      "noborder\n";
  script += "set arrow from 1,graph 0 to 1,graph 1 nohead lw 1 lc rgb '#444444'\n" + labels;
  std::string plot = "plot ";
  constexpr std::array names = {"aim met", "aim missed", "no aim"}, fills = {"#009e73", "#d55e00", "#999999"};
  for (std::size_t i = 0; i < data.size(); ++i) {
    if (data[i].empty()) continue;
    script += fmt::format("$d{} << EOD\n{}EOD\n", i, data[i]);
    plot += fmt::format("{}$d{} with boxxyerror lc rgb '{}' title '{}'", plot.size() > 5 ? ", " : "", i, fills[i],
                        names[i]);
  }
  if (!aims.empty()) {
    script += fmt::format("$aims << EOD\n{}EOD\n", aims);
    plot += ", $aims with vectors nohead lw 3 lc rgb 'black' title 'aim'";
  }
  return Picture{suite.name,       file_name(suite.name + "-ratios"),  suite.name + ": ratios", script + plot + "\n",
                 180 + 30 * count, 750 + 8 * static_cast<int>(longest)};  // room for bars beside the longest name
}

}  // namespace

std::vector<Picture> pictures(const std::vector<Row>& rows) {
  const std::array<Quantity, 3> quantities = {
      Quantity{"error", "error", [](const Row& row) { return row.error; }},
      Quantity{"time", "wall time of one repetition, ms (median)", [](const Row& row) { return row.wall_ms; }},
      Quantity{"memory", "peak memory, MiB", [](const Row& row) -> std::optional<double> {
                 if (!row.peak_bytes) return std::nullopt;
                 return static_cast<double>(*row.peak_bytes) / (1 << 20);
               }}};
  std::vector<Picture> all;
  const auto add = [&](std::optional<Picture> picture) {
    if (picture) all.push_back(std::move(*picture));
  };
  for (const Group& suite : group(rows, [](const Row& row) { return row.suite; })) {
    add(bars(suite));
    add(written(suite));
    for (const Group& one : group(suite.rows, front_name))
      for (const std::string& further : further_errors(one)) add(scatter(suite.name, one, further));
    for (const Group& line : group(suite.rows, [](const Row& row) {
           const auto found = row.counters.find("line");
           return found == row.counters.end() ? "" : found->second;
         }))
      for (const Quantity& quantity : quantities) add(lines(suite.name, line, quantity));
  }
  return all;
}

}  // namespace nadir::bench
