#pragma once

#include <cstddef>
#include <vector>

#include "nadir/sim/run.h"

namespace nadir::sim {

/// An exposure is on the map where all its corners are.
bool on_map(const render::Truth& truth);

/// Keeps evenly spread exposures of each sensor while a run is flown without rendering: its own memory does not grow
/// with the run's length.
class Rehearsal final : public Sink {
 public:
  struct Exposure {
    VehicleState state;
    render::Truth truth;
  };

  /// Of each sensor at least `least` are kept, if it makes as many, and never more than 16 times that.
  Rehearsal(const Run& run, std::size_t least) : run_(run), least_(least), sensors_(run.sensors().size()) {}

  Result<void> on_frame(const FrameEvent& event) override;

  /// In the order of time, the first one among them; by the index of the sensor in Run::sensors().
  const std::vector<Exposure>& kept(std::size_t sensor) const { return sensors_[sensor].kept; }
  std::size_t count(std::size_t sensor) const { return sensors_[sensor].count; }  // kept or not

 private:
  struct Exposures {
    std::vector<Exposure> kept;
    std::size_t count = 0, stride = 1;
  };
  const Run& run_;
  const std::size_t least_;
  std::vector<Exposures> sensors_;
};

}  // namespace nadir::sim
