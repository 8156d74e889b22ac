#include "nadir/record/flights_report.h"
#include "nadir/base/time.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "nadir/geodesy/geodetic.h"
#include "nadir/record/line_file.h"
#include "nadir/record/report.h"

namespace nadir::record {
namespace {

using sim::FlightOutcome;
using Group = std::vector<const FlightOutcome*>;

/// Flights of each vehicle.
std::map<std::string, Group> by_vehicle(std::span<const FlightOutcome> outcomes) {
  std::map<std::string, Group> groups;
  for (const FlightOutcome& one : outcomes) groups[one.vehicle].push_back(&one);
  return groups;
}

/// How far flights of one vehicle are from the middle of them all, over time.
Chart spread(const std::string& vehicle, const Group& flights, double duration_s) {
  Chart chart{vehicle + ": distance from the mean of all flights", "distance / m", {{"median", {}}, {"95 %", {}}}};
  std::size_t most = 0;
  for (const FlightOutcome* one : flights) most = std::max(most, one->track_en_m.size() / 2);
  for (std::size_t i = 0; i < most; ++i) {
    double east = 0, north = 0, count = 0;
    for (const FlightOutcome* one : flights)
      if (2 * i < one->track_en_m.size()) east += one->track_en_m[2 * i], north += one->track_en_m[2 * i + 1], ++count;
    std::vector<double> away;
    for (const FlightOutcome* one : flights)
      if (2 * i < one->track_en_m.size())
        away.push_back(std::hypot(one->track_en_m[2 * i] - east / count, one->track_en_m[2 * i + 1] - north / count));
    std::sort(away.begin(), away.end());
    const double t = most > 1 ? duration_s * static_cast<double>(i) / static_cast<double>(most - 1) : 0;
    chart.series[0].points.push_back({t, away[(away.size() - 1) / 2]});
    chart.series[1].points.push_back({t, away[static_cast<std::size_t>(0.95 * static_cast<double>(away.size() - 1))]});
  }
  return chart;
}

Histogram histogram(const std::string& title, const std::string& label, const Group& flights,
                    double FlightOutcome::*value) {
  Histogram made{title, label, {}, "flights"};
  for (const FlightOutcome* one : flights) made.values.push_back(one->*value);
  return made;
}

Result<void> write_rows(const std::filesystem::path& path, std::span<const FlightOutcome> outcomes) {
  auto file = LineFile::create(path,
                               "seed,vehicle,end_s,end_east_m,end_north_m,end_up_m,worst_off_path_m,"
                               "worst_height_error_m,least_airspeed_mps,greatest_airspeed_mps,greatest_roll_deg,fault");
  if (!file) return fail(file);
  for (const FlightOutcome& o : outcomes) {
    std::string fault = o.fault;  // on one line, in quotes
    for (char& c : fault) c = c == '\n' ? ' ' : c == '"' ? '\'' : c;
    const std::string row = fmt::format(
        "{},{},{},{},{},{},{},{},{},{},{},{}", o.seed, o.vehicle, o.end_s, o.end_east_m, o.end_north_m, o.end_up_m,
        o.worst_off_path_m, o.worst_height_error_m, o.least_airspeed_mps, o.greatest_airspeed_mps,
        geodesy::to_degrees(o.greatest_roll_rad), fault.empty() ? "" : "\"" + fault + "\"");
    if (auto ok = file->add(row); !ok) return ok;
  }
  return file->close();
}

}  // namespace

Result<void> write_flights(const std::filesystem::path& folder, const sim::RunFile& run,
                           std::span<const FlightOutcome> outcomes, double seconds) {
  if (auto ok = write_rows(folder / "flights.csv", outcomes); !ok) return ok;

  const auto groups = by_vehicle(outcomes);
  const double duration_s = seconds_from_ns(run.duration_ns);
  const auto early = std::count_if(outcomes.begin(), outcomes.end(), [](const auto& o) { return !o.fault.empty(); });
  const std::size_t flights = groups.empty() ? 0 : groups.begin()->second.size();
  Report report{"Many flights of one run",
                fmt::format("seeds from {}; {} s each, simulated in {:.1f} s", run.seed, run.duration_text, seconds)};
  report.figures = {
      {"flights", std::to_string(flights), "", fmt::format("of {} vehicles", groups.size())},
      {"ended early", std::to_string(early), "", "", early > 0 ? Figure::State::Warn : Figure::State::Good},
      {"faster than time", fmt::format("{:.0f}", static_cast<double>(flights) * duration_s / std::max(seconds, 1e-9)),
       "times"}};
  for (const auto& [vehicle, group] : groups) {
    Section section{vehicle, ""};
    section.items.emplace_back(spread(vehicle, group, duration_s));
    section.items.emplace_back(
        histogram(vehicle + ": farthest from the path", "distance / m", group, &FlightOutcome::worst_off_path_m));
    section.items.emplace_back(
        histogram(vehicle + ": farthest from its height", "distance / m", group, &FlightOutcome::worst_height_error_m));
    section.items.emplace_back(
        histogram(vehicle + ": least airspeed", "airspeed / (m/s)", group, &FlightOutcome::least_airspeed_mps));
    List faults{"ended early", {}};
    for (const FlightOutcome* one : group)
      if (!one->fault.empty()) faults.lines.push_back(fmt::format("seed {}: {}", one->seed, one->fault));
    if (!faults.lines.empty()) section.items.emplace_back(std::move(faults));
    report.sections.push_back(std::move(section));
  }
  return write_report(folder / "report.html", report);
}

}  // namespace nadir::record
