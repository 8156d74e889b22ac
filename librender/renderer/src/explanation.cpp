#include "nadir/render/explanation.h"

#include <fmt/format.h>

#include <span>

#include "nadir/base/text.h"

namespace nadir::render {
namespace {

std::string describe_mapping(const LayerExplanation& layer) {
  if (layer.homographies == 1 && layer.quadratics == 0 && layer.patches_by_pixel == 0)
    return fmt::format("one homography, off by {:.2g} px where checked (tolerance {} px)", layer.mapping_error_px,
                       layer.tolerance_px);
  return fmt::format(
      "{} homographies, {} quadratics and {} patches by pixel, off by {:.2g} px where checked (tolerance {} px)",
      layer.homographies, layer.quadratics, layer.patches_by_pixel, layer.mapping_error_px, layer.tolerance_px);
}

std::string describe_levels(const LayerExplanation& layer) {
  std::string text;
  for (const LevelUse& use : layer.levels)
    text += fmt::format("{}{} in {} blocks", text.empty() ? "" : ", ", use.level, use.blocks);
  return text;
}

void add(const LayerExplanation& layer, ExplanationText& text) {
  const auto does = [&](std::string line) { text.done.push_back(fmt::format("{}: {}", layer.name, line)); };
  const auto without = [&](std::string line) { text.left_out.push_back(fmt::format("{}: {}", layer.name, line)); };

  does(fmt::format("{}, {}, role {}, {} of {} bands as {}", layer.map, layer.crs, tile::to_string(layer.role),
                   layer.bands, layer.bands_of_map, tile::to_string(layer.type)));
  does(layer.mapping_shared ? "mapping shared with an earlier layer of the same CRS"
                            : "mapping: " + describe_mapping(layer));
  if (!layer.levels.empty()) {
    does(fmt::format("levels {} to {} of {}, filter {}, {:.2f} samples a pixel, {} cells of {} in all, {} blocks",
                     layer.levels.front().level, layer.levels.back().level, layer.levels_of_map,
                     to_string(layer.filter), layer.samples_a_pixel(), layer.cells, format_bytes(layer.cell_bytes),
                     layer.blocks));
    if (layer.levels.size() > 1) does("level " + describe_levels(layer));
  }
  if (layer.expected_rmse) does(fmt::format("expected error {:.3g} RMS beside the reference", *layer.expected_rmse));
  if (layer.coarse && layer.coarse->levels > 0)
    does(fmt::format("{:.1f} % of the pixels from up to {} levels coarser than planned: their cells were not in memory",
                     100 * layer.coarse->fraction, layer.coarse->levels));
  if (layer.undersampled)
    does("some pixels span more texels than are sampled: the map has too few levels (nadir build adds them)");

  if (layer.closed_form) without("projection library: the CRS has a closed form");
  if (layer.bands < layer.bands_of_map)
    without(fmt::format("{} bands: not asked for", layer.bands_of_map - layer.bands));
  if (!layer.levels.empty()) {
    const int finest = layer.levels.front().level, coarsest = layer.levels.back().level;
    if (finest > 0) without(fmt::format("levels finer than {}: no pixel is that fine", finest));
    if (coarsest + 1 < layer.levels_of_map)
      without(fmt::format("levels coarser than {}: no pixel is that coarse", coarsest));
  }
  const auto percent = [&](std::int64_t pixels) {
    return 100 * static_cast<double>(pixels) / static_cast<double>(layer.pixels);
  };
  if (layer.pixels_no_ground > 0) without(fmt::format("{:.1f} % of the image: sky", percent(layer.pixels_no_ground)));
  if (layer.pixels_off_map > 0)
    without(fmt::format("{:.1f} % of the image: blocks off the map", percent(layer.pixels_off_map)));
}

}  // namespace

ExplanationText to_text(const Explanation& explanation) {
  ExplanationText text;
  for (const LayerExplanation& layer : explanation.layers) add(layer, text);
  if (explanation.bands > 1)
    text.done.push_back(fmt::format("{} bands of {} rows, of which the first one is told above", explanation.bands,
                                    explanation.band_rows));
  const FrameCounters& counters = explanation.counters;
  text.done.push_back(fmt::format("frame: {} layers, {} exact points, {} points through the projection library",
                                  explanation.layers.size(), counters.exact_points, counters.projection_points));
  text.done.push_back(fmt::format("tiles: {} cells, {} read with the tiles that hold them, {} passes", counters.cells,
                                  counters.cells_loaded, counters.passes));
  text.left_out.push_back(explanation.plane ? "the Earth's curvature and terrain: the surface is a plane"
                                            : "terrain: the surface is an ellipsoid");
  if (explanation.ideal_lens) text.left_out.push_back("lens undistortion: the camera is an ideal pinhole");
  if (counters.cells > 0 && counters.cells_loaded == 0) text.left_out.push_back("reading: all cells were in the cache");
  if (const auto& exposure = explanation.exposure)
    text.done.push_back(fmt::format("exposure: {} poses over {} s, in which what is seen goes {:.2f} px; readout {} s",
                                    exposure->poses, exposure->shutter.exposure_s, exposure->motion_px,
                                    exposure->shutter.readout_s));
  return text;
}

std::string to_text(const StageTimes& times) {
  std::string text = fmt::format("{:.3g} ms:", times.whole_ms);
  for (const Stage& stage : std::span(stages).subspan(1))
    text += fmt::format("{} {} {:.3g} ms ({:.1f} %)", text.ends_with(':') ? "" : ",", stage.name, times.*stage.ms,
                        100 * times.share(stage.ms));
  return text;
}

}  // namespace nadir::render
