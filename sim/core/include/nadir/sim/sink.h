#pragma once

#include <string>

#include "nadir/base/result.h"
#include "nadir/render/camera.h"
#include "nadir/render/frame.h"
#include "nadir/sim/pose_source.h"

namespace nadir::sim {

/// One exposure of a sensor.
struct FrameEvent {
  const std::string& vehicle;
  const std::string& sensor;
  const VehicleState& state;
  const render::Frame* frame;  // its one layer has the sensor's name; null where it was rejected or nothing is rendered
  const render::Truth& truth;  // the frame's, else its geometry alone
  const std::string& rejected;  // why; empty where it was not
};

/// Where a run goes: a dataset, a report, a bridge to another program. Called in the order of simulated time, from one
/// thread.
class Sink {
 public:
  virtual ~Sink() = default;
  virtual Result<void> on_state(const std::string& vehicle, const VehicleState& state) {
    (void)vehicle, (void)state;
    return {};
  }
  virtual Result<void> on_frame(const FrameEvent& event) {
    (void)event;
    return {};
  }
  /// At the run's end, whether it was good or not.
  virtual Result<void> finish() { return {}; }
};

}  // namespace nadir::sim
