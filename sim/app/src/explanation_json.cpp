#include "explanation_json.h"

namespace nadir::app {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const render::LayerExplanation& layer) {
  Json levels = Json::array();
  for (const render::LevelUse& use : layer.levels)
    levels.push_back({{"level", use.level}, {"blocks", use.blocks}, {"pixels", use.pixels}});
  return {{"name", layer.name},
          {"map", layer.map},
          {"crs", layer.crs},
          {"role", tile::to_string(layer.role)},
          {"type", tile::to_string(layer.type)},
          {"bands", layer.bands},
          {"bands_of_map", layer.bands_of_map},
          {"mapping",
           {{"shared", layer.mapping_shared},
            {"closed_form", layer.closed_form},
            {"homographies", layer.homographies},
            {"quadratics", layer.quadratics},
            {"patches_by_pixel", layer.patches_by_pixel},
            {"error_px", layer.mapping_error_px},
            {"tolerance_px", layer.tolerance_px}}},
          {"filter", render::to_string(layer.filter)},
          {"oversampling", layer.oversampling},
          {"levels_of_map", layer.levels_of_map},
          {"levels", std::move(levels)},
          {"blocks", layer.blocks},
          {"pixels", layer.pixels},
          {"pixels_sampled", layer.pixels_sampled},
          {"pixels_no_ground", layer.pixels_no_ground},
          {"pixels_off_map", layer.pixels_off_map},
          {"samples_a_pixel", layer.samples_a_pixel()},
          {"cells", layer.cells},
          {"cell_bytes", layer.cell_bytes},
          {"undersampled", layer.undersampled},
          {"coarse",
           layer.coarse ? Json{{"fraction", layer.coarse->fraction}, {"levels", layer.coarse->levels}} : Json(nullptr)},
          {"expected_rmse", layer.expected_rmse ? Json(*layer.expected_rmse) : Json(nullptr)}};
}

}  // namespace

nlohmann::ordered_json to_json(const render::StageTimes& times) {
  Json json;
  for (const auto& stage : render::stages) {
    const std::string name(stage.name);
    json[name + "_ms"] = times.*stage.ms;
    if (stage.ms != &render::StageTimes::whole_ms) json[name + "_share"] = times.share(stage.ms);
  }
  return json;
}

nlohmann::ordered_json to_json(const render::Explanation& explanation) {
  Json layers = Json::array();
  for (const render::LayerExplanation& layer : explanation.layers) layers.push_back(to_json(layer));
  const render::FrameCounters& counters = explanation.counters;
  Json exposure = nullptr;
  if (const auto& e = explanation.exposure)
    exposure = {{"exposure_s", e->shutter.exposure_s},
                {"readout_s", e->shutter.readout_s},
                {"motion_px", e->motion_px},
                {"poses", e->poses}};
  const render::ExplanationText text = to_text(explanation);
  return {{"layers", std::move(layers)},
          {"frame",
           {{"surface", explanation.plane ? "plane" : "ellipsoid"},
            {"ideal_lens", explanation.ideal_lens},
            {"exact_points", counters.exact_points},
            {"projection_points", counters.projection_points},
            {"samples", counters.samples},
            {"cells", counters.cells},
            {"cells_loaded", counters.cells_loaded},
            {"windows_read", counters.windows_read},
            {"passes", counters.passes},
            {"bands", explanation.bands}}},
          {"exposure", std::move(exposure)},
          {"times", to_json(counters.times)},
          {"done", text.done},
          {"left_out", text.left_out}};
}

}  // namespace nadir::app
