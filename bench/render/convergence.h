#pragma once

#include <memory>
#include <vector>

#include "nadir/render/renderer.h"
#include "scenery.h"

namespace nadir::bench {

/// A view of a map of floats, whose frames nothing rounds: for errors below those of 8 bits.
class FineView {
 public:
  static Result<std::shared_ptr<FineView>> make(const RunOptions& options, const Pose& pose, int width, int height);

  Result<std::vector<float>> render(const render::RenderOptions& options);

 private:
  FineView(const tile::Map& map, render::Camera camera, const View& view);
  render::Scene scene_;
  render::Camera camera_;
  render::CameraPose pose_;
  render::Renderer renderer_;
};

/// The reference filter with so many samples a texel.
render::RenderOptions reference_with(double samples_a_texel);
/// As many as may be asked for.
inline constexpr double finest_reference = 16;

/// Root mean square difference, in 255ths of the map's range.
double difference(const std::vector<float>& a, const std::vector<float>& b);

/// How the reference filter's error falls with its samples, beside the errors that it judges.
std::vector<Case> convergence_cases(const RunOptions& options);

}  // namespace nadir::bench
