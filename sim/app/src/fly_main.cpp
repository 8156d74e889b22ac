// nadir fly: the whole simulator: vehicles fly, cameras render, and a dataset with a report is left.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "command.h"
#include "nadir/base/files.h"
#include "nadir/base/progress.h"
#include "nadir/base/text.h"
#include "nadir/base/time.h"
#include "nadir/record/event_record.h"
#include "nadir/record/flight_report.h"
#include "nadir/record/flights_report.h"
#include "nadir/record/run_sinks.h"
#include "nadir/record/scratch_dataset.h"
#include "nadir/record/telemetry.h"
#include "nadir/record/time_budget_record.h"
#include "nadir/sim/monte_carlo.h"
#include "nadir/sim/preflight.h"
#include "nadir/sim/run.h"
#include "tell_time_budget.h"

namespace nadir::app {
namespace {

struct FlyArguments {
  std::string run, folder, cache = "256MiB";
  int threads = 0, flights = 0;
  double pace = 0;
  bool dry_run = false, force = false, json = false;
};

/// Advances the progress bar by simulated time.
class ProgressSink final : public sim::Sink {
 public:
  ProgressSink(std::int64_t duration_ns, bool enabled)
      : progress_("flying", "simulated ms", std::max<std::int64_t>(duration_ns / 1'000'000, 1), enabled) {}
  Result<void> on_state(const std::string&, const sim::VehicleState& state) override {
    const std::int64_t now_ms = state.time_ns / 1'000'000;
    progress_.advance(now_ms - done_ms_);
    done_ms_ = now_ms;
    return {};
  }

 private:
  Progress progress_;
  std::int64_t done_ms_ = 0;
};

void print_summary(const FlyArguments& arguments, const sim::Run& run, const sim::RunSummary& summary,
                   const record::FlightReport& report, const std::vector<std::string>& budgets) {
  std::vector<double> ms = report.frame_ms();
  std::sort(ms.begin(), ms.end());
  const double median = ms.empty() ? 0 : ms[ms.size() / 2];
  if (arguments.json) {
    nlohmann::ordered_json json = {{"frames", summary.frames},
                                   {"rejected", summary.rejected},
                                   {"coarse", summary.coarse},
                                   {"seconds", summary.seconds},
                                   {"simulated_seconds", seconds_from_ns(summary.flown_ns)},
                                   {"median_frame_ms", median},
                                   {"valid_fraction", report.mean_valid_fraction()},
                                   {"cross_track_m", report.worst_cross_track_m()},
                                   {"height_error_m", report.worst_height_error_m()},
                                   {"folder", arguments.folder}};
    nlohmann::ordered_json leaves = nlohmann::ordered_json::array();
    for (const auto& [sensor, excursions] : report.excursions())
      for (const record::Excursion& e : excursions)
        leaves.push_back({{"sensor", sensor}, {"from_ns", e.from_ns}, {"to_ns", e.to_ns}, {"exposures", e.exposures}});
    json["leaves_map"] = leaves;
    json["ended_early"] = summary.ended() != nullptr;
    json["events"] = nlohmann::ordered_json::array();
    for (const sim::RunEvent& event : summary.events)
      json["events"].push_back(nlohmann::ordered_json::parse(record::event_record(event)));
    if (!budgets.empty()) {
      json["time_budgets"] = nlohmann::ordered_json::array();
      for (const std::string& line : budgets) json["time_budgets"].push_back(nlohmann::ordered_json::parse(line));
      json["late"] = summary.late;
    }
    fmt::print("{}\n", json.dump(2));
    return;
  }
  if (!arguments.dry_run)
    fmt::print(
        "{} frames of a flight of {} s in {:.1f} s: {:.1f} frames a second, {:.1f} ms each in the renderer (median), "
        "{:.1f} % of the pixels on the map\n",
        summary.frames, seconds_from_ns(summary.flown_ns), summary.seconds,
        static_cast<double>(summary.frames) / std::max(summary.seconds, 1e-9), median,
        100 * report.mean_valid_fraction());
  if (!budgets.empty()) fmt::print("{} of the frames with a time budget took longer\n", summary.late);
  if (summary.rejected > 0) fmt::print("{} exposures were rejected: they look beyond the map\n", summary.rejected);
  if (summary.coarse > 0)
    fmt::print("{} frames are partly from coarser levels than planned: their map tiles were not in memory in time\n",
               summary.coarse);
  if (report.flown())
    fmt::print("at most {:.1f} m off the path and {:.1f} m off its height{}\n", report.worst_cross_track_m(),
               report.worst_height_error_m(),
               report.settle_s() > 0 ? fmt::format(", after the first {} s", report.settle_s()) : "");
  for (const auto& [sensor, excursions] : report.excursions())
    for (const record::Excursion& e : excursions)
      fmt::print("{} leaves the map from {:.2f} s to {:.2f} s ({} exposures)\n", sensor, seconds_from_ns(e.from_ns),
                 seconds_from_ns(e.to_ns), e.exposures);
  for (const sim::RunEvent& event : summary.events)
    if (!event.event.ends_flight) fmt::print("{}\n", in_words(event));
  if (run.file().record_report || arguments.dry_run) fmt::print("look at {}/report.html\n", arguments.folder);
}

/// Resolved, told, and one record each. Frames that are tried are written as all will be, if that goes on beside
/// frames: where a pace leaves the machine idle between them, it does not.
Result<std::vector<std::string>> fit_time_budgets(const FlyArguments& arguments, sim::Run& run,
                                                  render::Renderer& renderer) {
  record::ScratchDataset scratch(arguments.folder);
  const auto write = [&](render::Frame frame) { return scratch.add(std::move(frame)); };
  if (auto ok = run.fit_time_budgets(renderer, arguments.pace > 0 ? render::TriedFrames() : write); !ok)
    return fail(ok);
  std::vector<std::string> records;
  for (const sim::PreparedSensor& sensor : run.sensors()) {
    if (!sensor.fitted) continue;
    records.push_back(record::time_budget_record(sensor.vehicle, {sensor.name}, sensor.setup.adaptive, *sensor.fitted));
    tell_time_budget(fmt::format("nadir fly: {}/{}", sensor.vehicle, sensor.name), *sensor.fitted,
                     sensor.setup.adaptive, arguments.json);
  }
  return records;
}

/// Doubtful findings are told, impossible ones are the error.
Result<void> look_before_flight(const sim::Run& run) {
  const auto findings = sim::preflight(run);
  if (!findings) return fail(findings);
  const std::string doubtful = sim::preflight_text(*findings, false), impossible = sim::preflight_text(*findings, true);
  if (!doubtful.empty()) fmt::print(stderr, "nadir fly: before the flight:\n{}\n", doubtful);
  if (!impossible.empty()) return fail(Error::Kind::Malformed, "cannot be flown:\n" + impossible);
  return {};
}

/// Many flights without cameras, each with draws of its own.
Result<void> run_many(const FlyArguments& arguments) {
  const auto file = sim::read_run_file(arguments.run);
  if (!file) return fail(file);
  const auto first = sim::Run::prepare(*file);
  if (!first) return fail(first);
  if (auto ok = look_before_flight(*first); !ok) return ok;
  if (auto ok = record::clear_dataset(arguments.folder, arguments.force); !ok) return ok;
  Progress progress("flying", "flights", arguments.flights, !arguments.json);
  const auto start = std::chrono::steady_clock::now();
  const auto outcomes =
      sim::fly_many(*file, arguments.flights, arguments.threads, [&](int more) { progress.advance(more); });
  if (!outcomes) return fail(outcomes);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (auto ok = record::write_flights(arguments.folder, *file, *outcomes, seconds); !ok) return ok;

  const auto early = std::count_if(outcomes->begin(), outcomes->end(), [](const auto& o) { return !o.fault.empty(); });
  const double simulated_s = arguments.flights * seconds_from_ns(file->duration_ns);
  if (arguments.json)
    fmt::print("{}\n", nlohmann::ordered_json{{"flights", arguments.flights},
                                              {"ended_early", early},
                                              {"seconds", seconds},
                                              {"simulated_seconds", simulated_s},
                                              {"folder", arguments.folder}}
                           .dump(2));
  else
    fmt::print("{} flights of {} s in {:.1f} s, {:.0f} times as fast as time; {} ended early\nlook at {}/report.html\n",
               arguments.flights, file->duration_text, seconds, simulated_s / std::max(seconds, 1e-9), early,
               arguments.folder);
  return {};
}

Result<void> run(const FlyArguments& arguments) {
  const auto cache_bytes = parse_bytes(arguments.cache);
  if (!cache_bytes) return fail(cache_bytes.error().kind, "--cache: " + cache_bytes.error().message);
  const auto file = sim::read_run_file(arguments.run);
  if (!file) return fail(file);
  auto run = sim::Run::prepare(*file);
  if (!run) return fail(run);
  if (auto ok = look_before_flight(*run); !ok) return ok;
  const bool frames = !arguments.dry_run && file->record_frames;

  if (auto ok = record::clear_dataset(arguments.folder, arguments.force); !ok) return ok;
  render::Renderer renderer({.cache_bytes = *cache_bytes, .threads = arguments.threads});
  std::vector<std::string> budgets;
  std::optional<record::Dataset> dataset;
  std::optional<record::FrameSink> frame_sink;
  if (frames) {
    auto created = record::Dataset::create(arguments.folder, /*force=*/true);
    if (!created) return fail(created);
    dataset.emplace(std::move(*created));
    frame_sink.emplace(*run, *dataset, arguments.threads);
    for (const sim::PreparedSensor& sensor : run->sensors())
      if (auto ok = dataset->add_camera(sensor.vehicle, sensor.camera); !ok) return ok;
    auto fitted = fit_time_budgets(arguments, *run, renderer);
    if (!fitted) return fail(fitted);
    budgets = std::move(*fitted);
    if (!budgets.empty())
      if (auto ok = dataset->write_time_budgets(budgets); !ok) return ok;
  }
  if (auto ok = write_file(std::filesystem::path(arguments.folder) / "run.yaml", sim::to_yaml(run->file())); !ok)
    return ok;

  record::FlightReport report(*run);
  record::TelemetrySink telemetry(*run, arguments.folder);
  record::TruthRowSink truth_rows(arguments.folder);
  ProgressSink progress(file->duration_ns, !arguments.json);
  std::vector<sim::Sink*> sinks = {&report, &progress};
  if (frame_sink) sinks.push_back(&*frame_sink);
  if (frames && file->record_truth_rows) sinks.push_back(&truth_rows);
  if (!arguments.dry_run && file->telemetry != sim::TelemetryFormat::None) sinks.push_back(&telemetry);

  const auto summary = run->execute(renderer, sinks, frames, arguments.pace);
  if (!summary) return fail(summary);
  if (file->record_report || arguments.dry_run)
    if (auto ok = report.write(renderer, arguments.folder, *summary, frames); !ok) return ok;
  if (auto ok = record::write_events(arguments.folder, summary->events); !ok) return ok;
  print_summary(arguments, *run, *summary, report, budgets);
  if (const sim::RunEvent* end = summary->ended())
    return fail(Error::Kind::Unsupported,
                fmt::format("{}; the run ended there, and what was recorded until then is whole", in_words(*end)));
  return report_damage(summary->damaged, summary->damage);
}

}  // namespace
}  // namespace nadir::app

int main(int argc, char** argv) {
  CLI::App app(
      "Flies the vehicles of a run file over its maps while their cameras render, and leaves frames, truth, telemetry "
      "and a report.",
      "nadir fly");
  nadir::app::FlyArguments a;
  app.add_option("RUN", a.run, "run file, YAML")->required();
  app.add_option("-o,--output-folder", a.folder, "folder for the dataset and report.html")->required();
  app.add_flag("--dry-run", a.dry_run,
               "fly without rendering: draw path and footprints, say where cameras leave the map");
  auto* flights =
      app.add_option("--flights", a.flights,
                     "fly so many times without cameras, each with a seed of its own (the run's, the next, ...), "
                     "over all cores; leaves flights.csv and a report of how they spread")
          ->check(CLI::Range(1, 1'000'000));
  app.add_flag("--force", a.force, "replace an earlier dataset in the folder");
  app.add_option("--pace", a.pace, "simulated seconds a second; 0: as fast as possible")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber)
      ->excludes(flights);
  app.add_option("--cache", a.cache, "memory for decoded map tiles")->capture_default_str();
  app.add_option("--threads", a.threads, "0: all the machine has")->capture_default_str()->check(CLI::Range(0, 1024));
  app.add_flag("--json", a.json, "summary for programs");
  app.footer(
      "examples:\n  nadir fly spain.yaml -o flight\n  nadir fly spain.yaml -o rehearsal --dry-run\n  nadir fly "
      "spain.yaml -o study --flights 200");
  return nadir::app::run_command(app, argc, argv,
                                 [&] { return a.flights > 0 ? nadir::app::run_many(a) : nadir::app::run(a); });
}
