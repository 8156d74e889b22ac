#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace nadir::render {

/// Wall time of the stages of a frame, by the machine's clock. For people: nothing is decided by it.
struct StageTimes {
  double preparing_ms = 0;  // checks, geometric truth, memory for pixels
  double mapping_ms = 0;
  double planning_ms = 0;  // blocks, levels, cells, expected error
  double reading_ms = 0;   // pinning cells, loading those that are not in memory
  double sampling_ms = 0;
  double finishing_ms = 0;  // output values, invalid pixels, means over an exposure
  double whole_ms = 0;      // of the frame

  double share(double StageTimes::*stage) const { return whole_ms > 0 ? this->*stage / whole_ms : 0; }
};

/// Its members, for who tells all of them.
struct Stage {
  std::string_view name;
  double StageTimes::*ms;
};
inline constexpr std::array<Stage, 7> stages = {{{"whole", &StageTimes::whole_ms},
                                                 {"preparing", &StageTimes::preparing_ms},
                                                 {"mapping", &StageTimes::mapping_ms},
                                                 {"planning", &StageTimes::planning_ms},
                                                 {"reading", &StageTimes::reading_ms},
                                                 {"sampling", &StageTimes::sampling_ms},
                                                 {"finishing", &StageTimes::finishing_ms}}};

/// What making a frame took.
struct FrameCounters {
  std::int64_t exact_points = 0;       // evaluations of the exact chain
  std::int64_t projection_points = 0;  // of them, through the projection library, and for truth and culling
  std::int64_t cells = 0, cells_loaded = 0;
  std::int64_t windows_read = 0, samples_read = 0;  // from maps
  std::int64_t samples = 0;                         // bilinear or nearest samples taken
  std::int64_t passes = 0;
  std::int64_t blocks_shared = 0;  // sampled with another layer's, on one grid, where samples lie being found once
  StageTimes times;
};

}  // namespace nadir::render
