#include "nadir/sim/rehearsal.h"

#include <algorithm>

namespace nadir::sim {

bool on_map(const render::Truth& truth) {
  return std::all_of(truth.footprint_uv.begin(), truth.footprint_uv.end(),
                     [](const auto& uv) { return uv && (uv->array() >= 0).all() && (uv->array() <= 1).all(); });
}

Result<void> Rehearsal::on_frame(const FrameEvent& event) {
  const PreparedSensor* sensor = &run_.sensor(event.vehicle, event.sensor);
  Exposures& exposures = sensors_[static_cast<std::size_t>(sensor - run_.sensors().data())];
  if (exposures.count++ % exposures.stride != 0) return {};
  exposures.kept.push_back({event.state, event.truth});
  if (exposures.kept.size() < 16 * least_) return {};

  // Half of them make room, and from here on half as many are kept
  for (std::size_t i = 0; 2 * i < exposures.kept.size(); ++i) exposures.kept[i] = std::move(exposures.kept[2 * i]);
  exposures.kept.resize((exposures.kept.size() + 1) / 2);
  exposures.stride *= 2;
  return {};
}

}  // namespace nadir::sim
