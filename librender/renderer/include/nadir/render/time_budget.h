#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "nadir/render/quality_ladder.h"
#include "nadir/render/renderer.h"

namespace nadir::render {

/// A way of sampling chosen for a time that frames may take. The clock is read before the first frame and not again:
/// whoever renders with `options` gets the same bytes, however long that takes.
struct FittedQuality {
  double budget_ms = 0;
  RenderOptions options;   // with the chosen way of sampling
  std::size_t rung = 0;    // that way, in quality_ladder()
  std::size_t probes = 0;  // frames tried that see a map
  /// Of each way tried, from the cheapest: what the slowest probe took, warm. The last may be over the budget. Of one
  /// that is, the first probe found to be. Empty where no probe sees a map.
  std::vector<double> measured_ms;

  std::optional<double> expected_ms() const;  // of the slowest probe
  bool fits() const;                          // else the cheapest way is taken, and misses or is unknown
};

/// For people: what was chosen, and why.
std::string to_string(const FittedQuality& fitted);

/// One rendering of a probe.
struct ProbedFrame {
  double ms = 0;
  bool sees_map = false;
};
/// Takes frames that were tried, as they will be taken once it counts: what it does in the background slows the next.
using TriedFrames = std::function<Result<void>(Frame frame)>;
/// A frame rejected because it looks beyond the map sees none. `then` may be empty.
Result<ProbedFrame> probed(Result<Frame> frame, const TriedFrames& then = {});
using RenderProbe = std::function<Result<ProbedFrame>(std::size_t probe, const RenderOptions& options)>;

/// The finest way of sampling of which each probe's median time, warm, is within the budget; each next finer one is
/// tried until one is not. Where even the cheapest is over, or no probe sees a map, the cheapest. `options` ask for no
/// filter, no oversampling and no error; their quality is replaced.
Result<FittedQuality> fit_time_budget(std::size_t probes, const RenderProbe& render_probe, const RenderOptions& options,
                                      double budget_ms);

/// The same with a few of the poses as probes.
Result<FittedQuality> fit_time_budget(Renderer& renderer, const Scene& scene, const Camera& camera,
                                      std::span<const CameraPose> poses, const RenderOptions& options,
                                      double budget_ms);

/// Error::Malformed unless it is a positive number.
Result<void> check_time_budget(double budget_ms);

/// At most five of `count` frames in a row, evenly spread, the first and the last among them.
std::vector<std::size_t> choose_probes(std::size_t count);

}  // namespace nadir::render
