#include "sim_suite.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>

#include "flights.h"
#include "nadir/base/files.h"
#include "nadir/record/telemetry.h"
#include "nadir/sim/monte_carlo.h"
#include "nadir/sim/plan_motion.h"
#include "nadir/sim/run.h"

namespace nadir::bench {
namespace {

using sim::Scheme, sim::Flight;
using M = Scheme::Method;

constexpr std::int64_t second_ns = 1'000'000'000;
/// As the simulator stepped before it planned: 400 times a second.
constexpr Scheme steps_at_400_hz{.method = M::Rk4, .steps = 4};

/// A flight under a scheme, at its start.
using Begin = std::function<Flight(const Scheme&)>;

/// A flight of so many seconds under a scheme, its greatest distance from the exact one.
Method flown(const std::string& name, const std::string& setting, const Scheme& scheme, const Begin& begin, int seconds,
             const std::shared_ptr<const std::vector<sim::BodyState>>& exact) {
  const auto evaluations = std::make_shared<std::int64_t>(0);
  return {.name = name,
          .setting = setting,
          .run = [=]() -> Result<void> {
            Flight flight = begin(scheme);
            const auto done = flight.fly(seconds * second_ns);
            *evaluations = flight.vehicle().work().evaluations;
            return done;
          },
          .error = [=]() -> Result<double> {
            Flight flight = begin(scheme);
            double worst = 0;
            for (const sim::BodyState& state : *exact) {
              if (auto ok = flight.fly(flight.time_ns() + Flight::period_ns); !ok) return fail(ok);
              worst = std::max(worst, apart_m(flight.vehicle().body(), state));
            }
            return worst;
          },
          .counters = [=]() -> std::map<std::string, std::string> {
            return {{"evaluations a simulated second", std::to_string(*evaluations / seconds)}};
          }};
}

/// `finest_m`: of what is planned for; rounding keeps attitudes from less.
Case by_scheme(const std::string& title, const RunOptions& options, const Begin& begin, double finest_m) {
  return {title, [=]() -> Result<Comparison> {
            const int seconds = options.quick ? 5 : 60;
            auto exact = std::make_shared<std::vector<sim::BodyState>>();
            Flight flight = begin({.method = M::Rk4, .steps = 64});
            while (flight.time_ns() < seconds * second_ns) {
              if (auto ok = flight.fly(flight.time_ns() + Flight::period_ns); !ok) return fail(ok);
              exact->push_back(flight.vehicle().body());
            }
            Comparison comparison{.error_unit = "m", .work = static_cast<double>(seconds), .work_unit = "simulated s"};
            const auto add = [&](const std::string& name, const std::string& setting, const Scheme& scheme) {
              comparison.methods.push_back(flown(name, setting, scheme, begin, seconds, exact));
            };
            add("rk4", "4 steps (400 Hz)", steps_at_400_hz);
            for (const M method : {M::Euler, M::Midpoint, M::Heun, M::Rk4})
              for (const int steps : {1, 2, 16})
                add(std::string(name_of(method)), fmt::format("{} steps", steps), {.method = method, .steps = steps});
            add("dormand-prince", "1 mm", {.method = M::DormandPrince});
            for (const double tolerance_m : {1.0, 1e-3, finest_m}) {
              const auto plan = sim::plan_motion([=](const Scheme& s) -> Result<Flight> { return begin(s); },
                                                 tolerance_m, seconds* second_ns);
              if (!plan) return fail(plan);
              add("planned", fmt::format("{:g} m", tolerance_m), plan->scheme);
            }
            comparison.aims = {{.method = label("planned", "0.001 m"), .baseline = label("rk4", "4 steps (400 Hz)")}};
            return comparison;
          }};
}

/// What the periods of a second of flight are spent on.
Case by_part() {
  return {"what a second of flight is spent on", []() -> Result<Comparison> {
            constexpr int periods = 100;
            Comparison comparison;
            for (const bool turbulent : {false, true}) {
              const auto air = std::make_shared<sim::AirAlongPath>(air_of_the_square(turbulent));
              comparison.methods.push_back(
                  {.name = "air", .setting = turbulent ? "turbulent" : "steady", .run = [=]() -> Result<void> {
                     const sim::PathPoint here = start_of_the_square();
                     const sim::Environment earth = sim::Environment::wgs84();
                     for (int i = 0; i < periods; ++i)
                       if (auto ok = air->advance(earth, here); !ok) return ok;
                     return {};
                   }});
            }
            const std::shared_ptr<sim::FlownVehicle> still = vehicle_of_the_square({});
            comparison.methods.push_back({.name = "autopilot", .setting = "", .run = [=]() -> Result<void> {
                                            for (int i = 0; i < periods; ++i)
                                              if (auto ok = still->decide(0, {}); !ok) return ok;
                                            return {};
                                          }});
            // Flown on from run to run, so that no start is timed, and steered, so that it stays in the air
            for (const auto& [setting, scheme] :
                 {std::pair("rk4, 4 steps", steps_at_400_hz), {"dormand-prince", Scheme{.method = M::DormandPrince}}}) {
              const std::shared_ptr<sim::FlownVehicle> steered = vehicle_of_the_square(scheme);
              comparison.methods.push_back({.name = "autopilot, motion",
                                            .setting = setting,
                                            .run = [=, now_ns = std::int64_t{0}]() mutable -> Result<void> {
                                              for (int i = 0; i < periods; ++i, now_ns += Flight::period_ns) {
                                                if (auto ok = steered->decide(now_ns, {}); !ok) return ok;
                                                if (auto ok = steered->move(now_ns, now_ns + Flight::period_ns, {});
                                                    !ok)
                                                  return ok;
                                              }
                                              return {};
                                            }});
            }
            comparison.methods.push_back({.name = "a start", .setting = "trims and gains", .run = []() -> Result<void> {
                                            vehicle_of_the_square(steps_at_400_hz);
                                            return {};
                                          }});
            return comparison;
          }};
}

/// The run file that a case flies, without cameras.
Result<sim::RunFile> run_file(const std::string& scratch, const std::string& record, int seconds) {
  const std::string path = scratch + "/run.yaml";
  const std::string text = fmt::format(
      "duration_s: {}\nscene:\n  layers:\n    eo: {{map: {}/sim/demo/maps/kampala.tif}}\nair: {{turbulence: "
      "{{intensity: "
      "light}}}}\nvehicles:\n  plane:\n    start: {{height: 500 agl}}\n    repeat_mission: true\n    mission: "
      "[{{north_m: "
      "900, east_m: 0}}, {{north_m: 900, east_m: 900}}, {{north_m: 0, east_m: 900}}, {{north_m: 0, east_m: 5}}]\n{}",
      seconds, NADIR_SOURCE_DIR, record);
  if (auto ok = write_file(path, text); !ok) return fail(ok);
  return sim::read_run_file(path);
}

Case recorded(const RunOptions& options) {
  return {"recorded", [=]() -> Result<Comparison> {
            const int seconds = options.quick ? 5 : 60;
            Comparison comparison{.work = static_cast<double>(seconds), .work_unit = "simulated s"};
            const auto add = [&](const std::string& name, const std::string& setting,
                                 const std::string& record) -> Result<void> {
              const auto file = run_file(options.scratch, record, seconds);
              if (!file) return fail(file);
              const auto planned = sim::Run::prepare(*file);
              if (!planned) return fail(planned);
              // Each repetition from the start: a prepared run flies once
              const auto run = std::make_shared<std::optional<sim::Run>>();
              comparison.methods.push_back({.name = name,
                                            .setting = setting,
                                            .run = [=, folder = options.scratch]() -> Result<void> {
                                              record::TelemetrySink telemetry(**run, folder);
                                              const bool keep = (*run)->file().telemetry != sim::TelemetryFormat::None;
                                              render::Renderer unused({.cache_bytes = 0, .threads = 1});
                                              const std::array<sim::Sink*, 1> sinks = {&telemetry};
                                              const auto done = (*run)->execute(
                                                  unused, std::span(sinks).first(keep ? 1 : 0), false, 0);
                                              if (!done) return fail(done);
                                              return {};
                                            },
                                            .before = [=, file = planned->file()]() -> Result<void> {
                                              auto made = sim::Run::prepare(file);
                                              if (!made) return fail(made);
                                              run->emplace(std::move(*made));
                                              return {};
                                            }});
              return {};
            };
            for (const auto& [name, setting, record] :
                 {std::tuple("nothing", "", "record: {telemetry: none, telemetry_rate_hz: 1}\n"),
                  {"npy", "50 Hz", "record: {telemetry: npy}\n"},
                  {"npy", "400 Hz", "record: {telemetry: npy, telemetry_rate_hz: 400}\n"},
                  {"csv", "50 Hz", "record: {telemetry: csv}\n"},
                  {"csv", "400 Hz", "record: {telemetry: csv, telemetry_rate_hz: 400}\n"}})
              if (auto ok = add(name, setting, record); !ok) return fail(ok);
            comparison.aims = {{.method = label("npy", "400 Hz"), .baseline = label("csv", "400 Hz")}};
            return comparison;
          }};
}

Case many(const RunOptions& options) {
  return {"many flights", [=]() -> Result<Comparison> {
            const int seconds = options.quick ? 5 : 60, flights = options.quick ? 4 : 32;
            auto file = run_file(options.scratch, "", seconds);
            if (!file) return fail(file);
            auto planned = sim::Run::prepare(*file);
            if (!planned) return fail(planned);
            Comparison comparison{.work = 1.0 * seconds * flights, .work_unit = "simulated s"};
            for (const int threads : {1, 2})
              comparison.methods.push_back({.name = "nadir",
                                            .setting = fmt::format("threads={}", threads),
                                            .run = [=, run = planned->file()]() -> Result<void> {
                                              const auto flown = sim::fly_many(run, flights, threads);
                                              if (!flown) return fail(flown);
                                              return {};
                                            }});
            comparison.aims = {{.method = "nadir, threads=2", .baseline = "nadir, threads=1", .most = 1 / 1.8}};
            return comparison;
          }};
}

/// Mean over six minutes, about ten circles: of the energy of a kilogram, J, and the greatest error of the quaternion's
/// length.
struct Loiter {
  double energy_j = 0, quaternion_error = 0;
};
Result<Loiter> loitering(Flight& flight) {
  constexpr int periods = 36'000;
  Loiter mean;
  for (int i = 0; i < periods; ++i) {
    if (auto ok = flight.fly(flight.time_ns() + Flight::period_ns); !ok) return fail(ok);
    const sim::BodyState& body = flight.vehicle().body();
    const double height_m = geodesy::geodetic_from_ecef(body.position).height_m;
    mean.energy_j += (9.80665 * height_m + 0.5 * body.velocity.xyz.squaredNorm()) / periods;
    mean.quaternion_error =
        std::max(mean.quaternion_error, std::abs(body.ecef_from_body.quaternion.coeffs().norm() - 1));
  }
  return mean;
}

/// A loiter of a day beside one of an hour: what grows with time shows, in memory, in energy and in the quaternion.
Case a_day(const RunOptions& options) {
  return {"loiter for a day", [=]() -> Result<Comparison> {
            const int unit_s = options.quick ? 20 : 3600;
            Comparison comparison{.error_unit = "J/kg", .warm_up = false, .rounds = 1};
            const auto first = std::make_shared<Loiter>();
            Flight begun = aerosonde_in_a_circle();
            if (auto ok = begun.fly(60 * second_ns); !ok) return fail(ok);
            const auto now = loitering(begun);
            if (!now) return fail(now);
            *first = *now;
            for (const int hours : {1, 24}) {
              const auto end = std::make_shared<std::optional<Flight>>();
              const auto last = std::make_shared<std::optional<Loiter>>();
              const auto at_the_end = [=]() -> Result<Loiter> {
                if (!*last) {
                  const auto found = loitering(**end);
                  if (!found) return fail(found);
                  *last = *found;
                }
                return **last;
              };
              comparison.methods.push_back(
                  {.name = "nadir",
                   .setting = fmt::format("{} h", hours),
                   .run = [=]() -> Result<void> {
                     end->emplace(aerosonde_in_a_circle());
                     return (*end)->fly(std::int64_t{hours} * unit_s * second_ns);
                   },
                   .error = [=]() -> Result<double> {
                     const auto loiter = at_the_end();
                     if (!loiter) return fail(loiter);
                     return std::abs(loiter->energy_j - first->energy_j);
                   },
                   .counters = [=]() -> std::map<std::string, std::string> {
                     const auto loiter = at_the_end();
                     if (!loiter) return {};
                     return {{"quaternion off unit length", fmt::format("{:.2g}", loiter->quaternion_error)}};
                   },
                   .peak = true});
            }
            comparison.aims = {{.method = "nadir, 24 h", .baseline = "nadir, 1 h", .most = 1.02, .cost = Cost::peak}};
            return comparison;
          }};
}

}  // namespace

Suite sim_suite() {
  return {"sim", "the flight simulator: simulated seconds a second, and their error",
          [](const RunOptions& options) -> std::vector<Case> {
            const auto plane = [](bool turbulent) {
              return [=](const Scheme& scheme) { return aerosonde_around_a_square(scheme, turbulent); };
            };
            const auto copter = [](bool motors_and_battery) {
              return [=](const Scheme& scheme) { return multirotor_around_a_square(scheme, motors_and_battery); };
            };
            return {by_scheme("by scheme", options, plane(false), 1e-6),
                    by_scheme("by scheme, in turbulence", options, plane(true), 1e-6),
                    by_scheme("by scheme, multirotor", options, copter(false), 1e-5),
                    by_scheme("by scheme, multirotor with motors and battery", options, copter(true), 1e-5),
                    by_part(),
                    recorded(options),
                    many(options),
                    a_day(options)};
          }};
}

}  // namespace nadir::bench
