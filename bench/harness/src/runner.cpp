#include "nadir/bench/runner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <chrono>
#include <cmath>
#include <limits>

#include "nadir/bench/machine.h"
#include "nadir/bench/measure.h"
#include "nadir/bench/statistics.h"

namespace nadir::bench {
namespace {

/// Long beside the clock's steps and the calls around it, which take well under a microsecond.
constexpr double least_sample_ms = 2;
constexpr int most_calls = 1'000'000;

struct Samples {
  int calls = 1;
  std::vector<double> wall_ms, cpu_ms;
  std::optional<std::uint64_t> peak_bytes;
  std::string fault;
};

/// What programs take that are started one after the other: times add up, peaks do not.
Result<Usage> measure_programs(const Method& method) {
  auto all = measure_command(method.command);
  for (const auto& command : method.then) {
    if (!all) break;
    const auto one = measure_command(command);
    if (!one) return fail(one);
    all->wall_ms += one->wall_ms;
    all->cpu_ms += one->cpu_ms;
    if (one->peak_bytes) all->peak_bytes = std::max(all->peak_bytes.value_or(0), *one->peak_bytes);
  }
  return all;
}

Result<Usage> repeat(const Method& method, int calls) {
  if (method.before)
    if (const auto ready = method.before(); !ready) return fail(ready);
  auto usage = !method.command.empty() ? measure_programs(method)
               : method.told           ? method.told()
                                       : measure(method.run, calls);
  if (method.after)
    if (const auto done = method.after(); usage && !done) return fail(done);
  return usage;
}

template <class T>
tl::unexpected<Error> fail_in(const std::string& case_name, const Method& method, const Result<T>& failed) {
  return fail(failed.error().kind,
              fmt::format("{}: {}: {}", case_name, label(method.name, method.setting), failed.error().message));
}

void add_ratio(const Aim& aim, const Comparison& comparison, const std::vector<Samples>& samples,
               std::vector<Row>& rows) {
  const auto place = [&](const std::string& name) {
    const auto found = std::find_if(comparison.methods.begin(), comparison.methods.end(),
                                    [&](const Method& method) { return label(method.name, method.setting) == name; });
    assert(found != comparison.methods.end());
    return static_cast<std::size_t>(found - comparison.methods.begin());
  };
  const std::size_t a = place(aim.method), b = place(aim.baseline);
  if (!rows[a].wall_ms || !rows[b].wall_ms) return;  // one of them did not take part
  double ratio = std::numeric_limits<double>::quiet_NaN();
  std::string prefix;
  switch (aim.cost) {
    case Cost::wall:
      ratio = paired_ratio(samples[a].wall_ms, samples[b].wall_ms);
      break;
    case Cost::cpu:
      prefix = "cpu_";
      ratio = paired_ratio(samples[a].cpu_ms, samples[b].cpu_ms);
      break;
    case Cost::peak:
      prefix = "peak_";
      if (samples[a].peak_bytes && samples[b].peak_bytes)
        ratio = static_cast<double>(*samples[a].peak_bytes) / static_cast<double>(*samples[b].peak_bytes);
      break;
  }
  if (!std::isfinite(ratio)) return;  // a baseline too short for the CPU clock, or no peak known
  const std::string of = ":" + aim.baseline + (aim.what.empty() ? "" : " (" + aim.what + ")");
  rows[a].counters[prefix + "ratio" + of] = fmt::format("{:.4g}", ratio);
  if (aim.most) rows[a].counters[prefix + "aim" + of] = fmt::format("{:.4g}", *aim.most);
  if (!aim.missed.empty()) rows[a].counters[prefix + "missed" + of] = as_counter(aim.missed);
}

Result<Row> row_of(const std::string& suite, const std::string& case_name, const Comparison& comparison,
                   const Method& method, const Samples& s) {
  Row row{.suite = suite, .case_name = case_name, .method = method.name, .setting = method.setting};
  row.commit = commit();
  if (!method.left_out.empty()) row.counters["left_out"] = as_counter(method.left_out);
  if (!s.fault.empty()) row.counters["fault"] = as_counter(s.fault);
  if (!row.counters.empty()) return row;

  row.cpu_ms = median(s.cpu_ms);
  row.wall_ms = median(s.wall_ms);
  row.peak_bytes = s.peak_bytes;
  if (method.counters) row.counters = method.counters();
  row.counters["rounds"] = std::to_string(s.wall_ms.size());
  row.counters["calls"] = std::to_string(s.calls);
  row.counters["wall_min_ms"] = fmt::format("{:.6g}", quantile(s.wall_ms, 0));
  row.counters["wall_q1_ms"] = fmt::format("{:.6g}", quantile(s.wall_ms, 0.25));
  row.counters["wall_q3_ms"] = fmt::format("{:.6g}", quantile(s.wall_ms, 0.75));
  row.counters["cpu_min_ms"] = fmt::format("{:.6g}", quantile(s.cpu_ms, 0));
  if (comparison.work > 0) {
    row.counters["rate"] = fmt::format("{:.6g}", comparison.work / *row.wall_ms * 1e3);
    row.counters["rate_unit"] = comparison.work_unit + "/s";
  }
  if (const auto& point = method.point ? method.point : comparison.point) {
    row.counters["line"] = point->line;
    row.counters["x"] = fmt::format("{}", point->x);
    row.counters["x_label"] = point->label;
    if (method.point) row.counters["point_of"] = method.name;
  }
  if (method.error) {
    const auto error = method.error();
    if (!error) return fail_in(case_name, method, error);
    row.error = *error;
    row.error_unit = comparison.error_unit;
  }
  return row;
}

}  // namespace

std::string label(const std::string& name, const std::string& setting) {
  return setting.empty() ? name : name + ", " + setting;
}

std::string as_counter(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  std::replace(text.begin(), text.end(), ';', ',');
  constexpr std::string_view equals = " = ";  // "at t = 1 s" reads on as "at t 1 s"
  for (std::size_t at; (at = text.find(equals)) != std::string::npos;) text.replace(at, equals.size(), 1, ' ');
  std::replace(text.begin(), text.end(), '=', ' ');
  return text;
}

std::vector<std::size_t> order_of_round(std::size_t methods, std::size_t round) {
  std::vector<std::size_t> order(methods);
  for (std::size_t i = 0; i < methods; ++i) order[i] = (round + i) % methods;
  return order;
}

Result<std::vector<Row>> run_comparison(const std::string& suite, const std::string& case_name,
                                        const Comparison& comparison, const RunOptions& options) {
  const auto& methods = comparison.methods;
  std::vector<Samples> samples(methods.size());
  const auto takes_part = [&](std::size_t i) { return methods[i].left_out.empty() && samples[i].fault.empty(); };
  /// A repetition of a method; nothing where it failed and the others go on.
  const auto try_once = [&](std::size_t i) -> Result<std::optional<Usage>> {
    const auto usage = repeat(methods[i], samples[i].calls);
    if (usage) return *usage;
    if (!comparison.go_on) return fail_in(case_name, methods[i], usage);
    samples[i].fault = usage.error().message;
    return std::nullopt;
  };

  // Peaks first, while no method has started threads that a forked process would lack
  for (std::size_t i = 0; i < methods.size(); ++i) {
    const Method& method = methods[i];
    if (!method.peak || !method.run || !takes_part(i)) continue;
    if (method.before)
      if (const auto ready = method.before(); !ready) return fail_in(case_name, method, ready);
    const auto peak = peak_in_child(method.run);
    if (!peak) return fail_in(case_name, method, peak);
    samples[i].peak_bytes = *peak;
    if (method.after)
      if (const auto done = method.after(); !done) return fail_in(case_name, method, done);
  }

  // Once without measuring: pages come in, caches fill
  for (std::size_t i = 0; comparison.warm_up && i < methods.size(); ++i) {
    if (!takes_part(i)) continue;
    const auto usage = try_once(i);
    if (!usage) return fail(usage);
    if (*usage && methods[i].run && !methods[i].before && !methods[i].after)
      samples[i].calls = static_cast<int>(
          std::clamp(std::ceil(least_sample_ms / std::max((*usage)->wall_ms, 1e-6)), 1.0, 1.0 * most_calls));
  }

  const auto start = std::chrono::steady_clock::now();
  const int wanted = comparison.rounds > 0 ? comparison.rounds : options.rounds;
  const auto enough = [&](int round) {
    if (wanted > 0) return round >= wanted;
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
    return round >= 51 || (round >= 3 && spent.count() >= options.budget_s);
  };
  for (int round = 0; !enough(round); ++round)
    for (const std::size_t i : order_of_round(methods.size(), static_cast<std::size_t>(round))) {
      if (!takes_part(i)) continue;
      const auto usage = try_once(i);
      if (!usage) return fail(usage);
      if (!*usage) continue;
      samples[i].wall_ms.push_back((*usage)->wall_ms);
      samples[i].cpu_ms.push_back((*usage)->cpu_ms);
      if ((*usage)->peak_bytes)
        samples[i].peak_bytes = std::max(samples[i].peak_bytes.value_or(0), *(*usage)->peak_bytes);
    }

  std::vector<Row> rows;
  for (std::size_t i = 0; i < methods.size(); ++i) {
    auto row = row_of(suite, case_name, comparison, methods[i], samples[i]);
    if (!row) return fail(row);
    rows.push_back(std::move(*row));
  }
  for (const Aim& aim : comparison.aims) add_ratio(aim, comparison, samples, rows);
  if (comparison.aims_of)
    for (const Aim& aim : comparison.aims_of(rows)) add_ratio(aim, comparison, samples, rows);
  if (comparison.picture) {
    const auto name = comparison.picture();
    if (!name) return fail(name);
    rows.front().counters["picture"] = *name;
  }
  return rows;
}

Result<std::vector<Row>> run_case(const std::string& suite, const Case& one, const RunOptions& options) {
  const auto csv = in_child([&]() -> Result<std::string> {
    const auto comparison = one.prepare();
    if (!comparison) return fail(comparison.error().kind, one.name + ": " + comparison.error().message);
    const auto rows = run_comparison(suite, one.name, *comparison, options);
    if (!rows) return fail(rows);
    return to_csv(*rows);
  });
  if (!csv) return fail(csv);
  return from_csv("the result of " + one.name, *csv);
}

}  // namespace nadir::bench
