#include "render_checks.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

namespace nadir::render {

Result<void> check(const RenderOptions& options) {
  if (!(options.geometry_tolerance_px > 0 && options.geometry_tolerance_px <= 1))
    return fail(Error::Kind::Malformed, fmt::format("geometry tolerance: expected image pixels in (0, 1], found {}",
                                                    options.geometry_tolerance_px));
  if (options.oversampling && !(*options.oversampling >= 0.5 && *options.oversampling <= 16))
    return fail(Error::Kind::Malformed,
                fmt::format("oversampling: expected 0.5 to 16 samples across, found {}", *options.oversampling));
  if (options.max_error && !(*options.max_error > 0))
    return fail(Error::Kind::Malformed,
                fmt::format("max error: expected a positive number, found {}", *options.max_error));
  if (options.level_blend && !(*options.level_blend >= 0 && *options.level_blend <= 1))
    return fail(Error::Kind::Malformed,
                fmt::format("level blend: expected a part of a level in [0, 1], found {}", *options.level_blend));
  if (!(options.motion_step_px > 0 && options.motion_step_px <= 1e3))
    return fail(Error::Kind::Malformed,
                fmt::format("motion step: expected image pixels in (0, 1000], found {}", options.motion_step_px));
  if (!std::isfinite(options.fill_value)) return fail(Error::Kind::Malformed, "fill value: expected a finite number");
  return {};
}

Result<void> refuse_off_map(const Layer& layer, const Truth& truth) {
  static constexpr std::array<const char*, 4> names = {"top left", "top right", "bottom right", "bottom left"};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& uv = truth.footprint_uv[i];
    const bool on_map = uv && (uv->array() >= 0).all() && (uv->array() <= 1).all();
    if (on_map) continue;
    const std::string where =
        truth.footprint_texel[i]
            ? fmt::format("sees texel ({:.1f}, {:.1f}) of {} x {}", truth.footprint_texel[i]->x(),
                          truth.footprint_texel[i]->y(), layer.source->map().width(), layer.source->map().height())
            : "sees no ground";
    return fail(Error::Kind::OutsideMap, fmt::format("layer {}: the image's {} corner {}: outside the map {}",
                                                     layer.name, names[i], where, truth.map_path));
  }
  return {};
}

}  // namespace nadir::render
