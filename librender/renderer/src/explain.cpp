#include "explain.h"

#include <fmt/format.h>

namespace nadir::render {
namespace {

std::string describe_mapping(const PatchMapping& mapping) {
  std::int64_t homographies = 0, quadratics = 0, per_pixel = 0;
  for (const Patch& patch : mapping.patches) {
    homographies += patch.kind == Patch::Kind::Homography;
    quadratics += patch.kind == Patch::Kind::Biquadratic;
    per_pixel += patch.kind == Patch::Kind::PerPixel;
  }
  if (mapping.patches.size() == 1 && homographies == 1)
    return fmt::format("one homography, off by {:.2g} px where checked (tolerance {} px)", mapping.error_px,
                       mapping.tolerance_px);
  return fmt::format(
      "{} homographies, {} quadratics and {} patches by pixel, off by {:.2g} px where checked (tolerance "
      "{} px)",
      homographies, quadratics, per_pixel, mapping.error_px, mapping.tolerance_px);
}

}  // namespace

void explain_layer(const Layer& layer, const PatchMapping& mapping, bool mapping_shared, const LayerPlan& plan,
                   const FrameLayer& frame, Explanation& explanation) {
  const tile::Map& map = layer.source->map();
  const auto does = [&](std::string text) { explanation.done.push_back(fmt::format("{}: {}", layer.name, text)); };
  const auto without = [&](std::string text) {
    explanation.left_out.push_back(fmt::format("{}: {}", layer.name, text));
  };

  does(fmt::format("{}, {}, role {}, {} of {} bands as {}", map.description().path, map.projection().name(),
                   tile::to_string(layer.options.role), layer.source->bands().size(), map.description().bands.size(),
                   tile::to_string(layer.source->type())));
  does(mapping_shared ? "mapping shared with an earlier layer of the same CRS"
                      : "mapping: " + describe_mapping(mapping));
  const double pixels = static_cast<double>(frame.width) * frame.height;
  if (!plan.blocks.empty())
    does(fmt::format("levels {} to {} of {}, filter {}, {:.2f} samples a pixel, {} cells, {} blocks", plan.finest_level,
                     plan.coarsest_level, map.levels().size(), to_string(frame.truth.filter),
                     static_cast<double>(plan.samples) / static_cast<double>(plan.pixels_sampled), frame.truth.tiles,
                     plan.blocks.size()));
  if (plan.undersampled)
    does("some pixels span more texels than are sampled: the map has too few levels (nadir build adds them)");

  if (!map.projection().uses_library()) without("projection library: the CRS has a closed form");
  if (layer.source->bands().size() < map.description().bands.size())
    without(fmt::format("{} bands: not asked for", map.description().bands.size() - layer.source->bands().size()));
  if (plan.finest_level > 0) without(fmt::format("levels finer than {}: no pixel is that fine", plan.finest_level));
  if (plan.coarsest_level + 1 < static_cast<int>(map.levels().size()))
    without(fmt::format("levels coarser than {}: no pixel is that coarse", plan.coarsest_level));
  if (plan.pixels_no_ground > 0)
    without(fmt::format("{:.1f} % of the image: sky", 100 * static_cast<double>(plan.pixels_no_ground) / pixels));
  if (plan.pixels_off_map > 0)
    without(fmt::format("{:.1f} % of the image: blocks off the map",
                        100 * static_cast<double>(plan.pixels_off_map) / pixels));
}

void explain_frame(const Scene& scene, const Camera& camera, const FrameCounters& counters, Explanation& explanation) {
  explanation.done.push_back(fmt::format(
      "frame: {} layers, {} exact points, {} points through the projection library, {} of {} cells read, {} passes",
      scene.layers().size(), counters.exact_points, counters.projection_points, counters.cells_loaded, counters.cells,
      counters.passes));
  explanation.left_out.push_back(scene.surface().plane() ? "the Earth's curvature and terrain: the surface is a plane"
                                                         : "terrain: the surface is an ellipsoid");
  if (camera.lens().ideal()) explanation.left_out.push_back("lens undistortion: the camera is an ideal pinhole");
  if (counters.cells > 0 && counters.cells_loaded == 0)
    explanation.left_out.push_back("reading: all cells were in the cache");
}

}  // namespace nadir::render
