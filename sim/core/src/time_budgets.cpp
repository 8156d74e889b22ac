#include <fmt/format.h>

#include <algorithm>

#include "nadir/sim/rehearsal.h"
#include "nadir/sim/run.h"

namespace nadir::sim {
namespace {

bool is_open(const PreparedSensor& sensor) { return sensor.setup.time_budget_ms && !sensor.fitted; }

void resolve(const render::FittedQuality& fitted, SensorSetup& setup) {
  const render::Rung& rung = render::quality_ladder()[fitted.rung];
  setup.quality = rung.quality;
  setup.oversampling = rung.oversampling;
  setup.fitted_to_ms = setup.time_budget_ms;
  setup.time_budget_ms.reset();
}

}  // namespace

Result<void> Run::fit_time_budgets(render::Renderer& renderer, const render::TriedFrames& then) {
  if (std::none_of(sensors_.begin(), sensors_.end(), is_open)) return {};

  // Where cameras will be, from a run of its own: flying changes a run's vehicles
  auto other = prepare(file_);
  if (!other) return fail(other);
  constexpr std::size_t least_exposures = 64;
  Rehearsal rehearsal(*other, least_exposures);
  Sink* const sinks[] = {&rehearsal};
  if (const auto flown = other->execute(renderer, sinks, /*render_frames=*/false, /*pace=*/0); !flown)
    return fail(flown);

  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    PreparedSensor& sensor = sensors_[i];
    if (!is_open(sensor)) continue;
    const auto& exposures = rehearsal.kept(i);
    const std::vector<std::size_t> probes = render::choose_probes(exposures.size());
    auto fitted = render::fit_time_budget(
        probes.size(),
        [&](std::size_t probe, const render::RenderOptions& options) {
          return render::probed(render_frame(renderer, exposures[probes[probe]].state, sensor, options), then);
        },
        render_options(sensor), *sensor.setup.time_budget_ms);
    if (!fitted) return fail(fitted.error().kind, fmt::format("sensor {}: {}", sensor.name, fitted.error().message));
    sensor.fitted = std::move(*fitted);
    if (sensor.setup.adaptive) continue;
    resolve(*sensor.fitted, sensor.setup);
    for (auto& [vehicle, setup] : file_.vehicles)
      for (auto& [name, sensor_setup] : setup.sensors)
        if (vehicle == sensor.vehicle && name == sensor.name) sensor_setup = sensor.setup;
  }
  return {};
}

}  // namespace nadir::sim
