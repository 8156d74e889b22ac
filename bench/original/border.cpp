#include <fmt/format.h>

#include "maps.h"
#include "must.h"
#include "nadir/render/renderer.h"
#include "original.h"
#include "sections.h"

namespace nadir::bench {

std::string border_section() {
  const tile::Map map = shipped_map("kampala.tif");
  const auto scene = render::Scene::plane(map.center(), {}).with_layer("eo", map, {.bands = {1, 2, 3}});
  const auto camera = must(render::Camera::pinhole(480, 360, 400, 400, 240, 180));
  const Original original(read_bgr(map), plane_of_map_units(map));
  render::Renderer renderer;

  // East from the middle, 60 m up and turned by 33 degrees, over the border and beyond: a footprint of 72 m x 54 m.
  constexpr int frames = 61;
  constexpr double step_m = 3;
  int published = 0, under_its_rule = 0, masked = 0, dropped_with_ground = 0;
  double valid = 0;
  for (int i = 0; i < frames; ++i) {
    EnuFromCamera enu_from_camera = level(i * step_m, 0, 60);
    enu_from_camera.rotation *=
        Eigen::Quaterniond(Eigen::AngleAxisd(geodesy::to_radians(33), Eigen::Vector3d::UnitZ()));
    const auto pose = scene.surface().frame().ecef_from_enu() * enu_from_camera;
    const bool its_frame = original.footprint(camera, enu_from_camera).has_value();
    const double fraction = must(renderer.render(scene, camera, pose)).truth().valid_fraction;
    published += its_frame;
    under_its_rule += renderer.render(scene, camera, pose, {.off_map = render::OffMap::Reject}).has_value();
    masked += fraction > 0;
    if (!its_frame && fraction > 0) ++dropped_with_ground, valid += fraction;
  }
  return fmt::format(
      "## Border\n\n"
      "{} frames over kampala.tif, level, from its middle to 66 m beyond its eastern border:\n\n"
      "| | frames |\n| --- | --- |\n"
      "| that see any of the map | {} |\n"
      "| original: all corners or nothing | {} |\n"
      "| ours, `--off-map reject`: the same rule | {} |\n"
      "| ours, `--off-map mask` | {} |\n"
      "| dropped by the original in sight of the map | {}, on average {:.0f} % of their pixels valid |\n",
      frames, masked, published, under_its_rule, masked, dropped_with_ground,
      dropped_with_ground ? 100 * valid / dropped_with_ground : 0.0);
}

}  // namespace nadir::bench
