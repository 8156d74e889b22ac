#include "nadir/bench/runner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <chrono>
#include <cmath>

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
};

Result<Usage> repeat(const Method& method, int calls) {
  if (method.before)
    if (const auto ready = method.before(); !ready) return fail(ready);
  auto usage = method.command.empty() ? measure(method.run, calls) : measure_command(method.command);
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
  const bool wall = aim.time == Time::wall;
  const double ratio =
      wall ? paired_ratio(samples[a].wall_ms, samples[b].wall_ms) : paired_ratio(samples[a].cpu_ms, samples[b].cpu_ms);
  if (!std::isfinite(ratio)) return;  // a baseline too short for the CPU clock
  const std::string prefix = wall ? "" : "cpu_";
  rows[a].counters[prefix + "ratio:" + aim.baseline] = fmt::format("{:.4g}", ratio);
  if (aim.most) rows[a].counters[prefix + "aim:" + aim.baseline] = fmt::format("{:g}", *aim.most);
}

}  // namespace

std::string label(const std::string& name, const std::string& setting) {
  return setting.empty() ? name : name + ", " + setting;
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

  // Peaks first, while no method has started threads that a forked process would lack
  for (std::size_t i = 0; i < methods.size(); ++i) {
    const Method& method = methods[i];
    if (!method.peak || !method.command.empty()) continue;
    if (method.before)
      if (const auto ready = method.before(); !ready) return fail_in(case_name, method, ready);
    const auto peak = peak_in_child(method.run);
    if (!peak) return fail_in(case_name, method, peak);
    samples[i].peak_bytes = *peak;
    if (method.after)
      if (const auto done = method.after(); !done) return fail_in(case_name, method, done);
  }

  // Once without measuring: pages come in, caches fill
  for (std::size_t i = 0; i < methods.size(); ++i) {
    const auto usage = repeat(methods[i], 1);
    if (!usage) return fail_in(case_name, methods[i], usage);
    if (!methods[i].before && !methods[i].after && methods[i].command.empty())
      samples[i].calls = static_cast<int>(
          std::clamp(std::ceil(least_sample_ms / std::max(usage->wall_ms, 1e-6)), 1.0, 1.0 * most_calls));
  }

  const auto start = std::chrono::steady_clock::now();
  const auto enough = [&](int round) {
    if (options.rounds > 0) return round >= options.rounds;
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
    return round >= 51 || (round >= 3 && spent.count() >= options.budget_s);
  };
  for (int round = 0; !enough(round); ++round)
    for (const std::size_t i : order_of_round(methods.size(), static_cast<std::size_t>(round))) {
      const auto usage = repeat(methods[i], samples[i].calls);
      if (!usage) return fail_in(case_name, methods[i], usage);
      samples[i].wall_ms.push_back(usage->wall_ms);
      samples[i].cpu_ms.push_back(usage->cpu_ms);
      if (usage->peak_bytes) samples[i].peak_bytes = std::max(samples[i].peak_bytes.value_or(0), *usage->peak_bytes);
    }

  std::vector<Row> rows;
  for (std::size_t i = 0; i < methods.size(); ++i) {
    const Method& method = methods[i];
    const Samples& s = samples[i];
    Row row{.suite = suite, .case_name = case_name, .method = method.name, .setting = method.setting};
    row.cpu_ms = median(s.cpu_ms);
    row.wall_ms = median(s.wall_ms);
    row.peak_bytes = s.peak_bytes;
    row.commit = commit();
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
    if (comparison.point) {
      row.counters["line"] = comparison.point->line;
      row.counters["x"] = fmt::format("{}", comparison.point->x);
      row.counters["x_label"] = comparison.point->label;
    }
    if (method.error) {
      const auto error = method.error();
      if (!error) return fail_in(case_name, method, error);
      row.error = *error;
      row.error_unit = comparison.error_unit;
    }
    rows.push_back(std::move(row));
  }
  for (const Aim& aim : comparison.aims) add_ratio(aim, comparison, samples, rows);
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
