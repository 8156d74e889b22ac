// How many seconds of flight a second of one core simulates, and what they are spent on. The vehicle steps at 400 Hz;
// rates are simulated seconds.
#include <benchmark/benchmark.h>

#include <memory>

#include "nadir/sim/air_along_path.h"
#include "nadir/sim/autopilot.h"
#include "nadir/sim/mission.h"

namespace {
using namespace nadir;
using namespace nadir::sim;

constexpr double step_s = 1.0 / 400;
const geodesy::Geodetic place = geodesy::Geodetic::degrees(38.1, -0.76, 3000);
const Eigen::Vector3d wind(3, -8, 0);

Environment environment(bool flat) { return flat ? Environment::flat(place) : Environment::wgs84(); }

void BM_VehicleAlone(benchmark::State& state, bool flat) {
  const FixedWing vehicle = aerosonde();
  const Environment air = environment(flat);
  const Trim cruise = trim(vehicle, {.airspeed_mps = 25}, air, place).value();
  FixedWingState s = trimmed_state(cruise, air, place, 0, wind);
  for (auto _ : state) s = advance(vehicle, air, s, cruise.controls, wind, 0, step_s).value();
  benchmark::DoNotOptimize(s);
  state.counters["simulated_s"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * step_s, benchmark::Counter::kIsRate);
}
BENCHMARK_CAPTURE(BM_VehicleAlone, flat, true);
BENCHMARK_CAPTURE(BM_VehicleAlone, wgs84, false);

/// Around a square with the autopilot at 100 Hz: four steps an iteration.
void BM_Mission(benchmark::State& state, bool flat) {
  const FixedWing vehicle = aerosonde();
  const Environment air = environment(flat);
  const geodesy::LocalFrame scene(place);
  const Surroundings here = air.at(geodesy::ecef_from_geodetic(place));
  const FeedForward ff = feed_forward(vehicle, 25, here.density_kgpm3, here.gravity_ecef_mps2.norm()).value();
  Autopilot autopilot(ff);
  const Waypoint corners[] = {{1000, 0, 0}, {1000, 1000, 20}, {0, 1000, 20}, {0, 5, 0}};
  Mission mission = Mission::create({0, 0, 0}, corners, 150, AfterMission::Repeat).value();
  FixedWingState s = trimmed_state(ff.level, air, place, 0, wind);
  for (auto _ : state) {
    const Navigation now = true_navigation(s, air, wind, scene);
    const Controls controls = autopilot.step(follow(mission.path_at(now), now, {}), now, 4 * step_s);
    for (int i = 0; i < 4; ++i) s = advance(vehicle, air, s, controls, wind, 0, step_s).value();
  }
  benchmark::DoNotOptimize(s);
  state.counters["simulated_s"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * 4 * step_s, benchmark::Counter::kIsRate);
}
BENCHMARK_CAPTURE(BM_Mission, flat, true);
BENCHMARK_CAPTURE(BM_Mission, wgs84, false);

/// One sample of the air along a flight, of which 100 make a second.
void BM_Air(benchmark::State& state, bool turbulent) {
  const Environment earth = environment(false);
  AirParts parts;
  parts.height_above_ground_m = [&](const geodesy::Point<geodesy::frame::Ecef>& p) { return earth.at(p).height_m; };
  parts.sources.push_back(std::make_unique<SteadyWind>(wind, Shear{}));
  if (turbulent) parts.turbulence = Turbulence(15, 3, RandomStream(1, "p"));
  PathPoint now{geodesy::ecef_from_geodetic(place),
                {earth.at(geodesy::ecef_from_geodetic(place)).ecef_from_ned.col(0) * 25}};
  AirAlongPath air = AirAlongPath::start(std::move(parts), now.position, {1, 0, 0}, 25).value();
  for (auto _ : state) {
    benchmark::DoNotOptimize(air.advance(earth, now));
    now.position.xyz += 0.01 * now.velocity.xyz;
  }
}
BENCHMARK_CAPTURE(BM_Air, steady, false);
BENCHMARK_CAPTURE(BM_Air, turbulent, true);

void BM_Trim(benchmark::State& state) {
  const FixedWing vehicle = aerosonde();
  for (auto _ : state)
    benchmark::DoNotOptimize(trim(vehicle, {.airspeed_mps = 25, .turn_radius_m = 150}, 1.2682, 9.81));
}
BENCHMARK(BM_Trim);

}  // namespace
