#include "motion_suite.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <optional>

#include "nadir/render/renderer.h"

namespace nadir::bench {
namespace {

using namespace render;

/// A drone over the map of Kampala that ships with the project, at 15 m/s and turning by 20 degrees a second, its
/// camera at one texel a pixel.
struct Flight {
  Scene scene;
  Camera camera;
  CameraMotion motion;
  Renderer renderer;
};

Result<std::shared_ptr<Flight>> flight(bool quick) {
  const auto map = tile::Map::open(NADIR_SOURCE_DIR "/sim/demo/maps/kampala.tif");
  if (!map) return fail(map);
  const int width = quick ? 160 : 1280, height = quick ? 90 : 720;
  geodesy::Geodetic place = map->center();
  place.height_m = 74.4;
  const CameraPose middle = camera_pose(place, geodesy::YawPitchRoll::degrees(33, 8, -6));
  const Eigen::Vector3d east = geodesy::ecef_from_ned(place).rotation * Eigen::Vector3d::UnitY();
  std::vector<Moment> moments;
  for (const double t : {-0.5, 0.5})
    moments.push_back({t,
                       {middle.rotation * rotation_by(t * Eigen::Vector3d(0.05, -0.1, geodesy::to_radians(20))),
                        middle.origin + t * 15 * east}});
  auto motion = CameraMotion::through(std::move(moments));
  if (!motion) return fail(motion);
  return std::make_shared<Flight>(Flight{
      Scene::plane(map->center(), {}).with_layer("eo", *map, {.bands = {1, 2, 3}}),
      Camera::pinhole(width, height, 1000.0 * width / 1280, 1000.0 * width / 1280, width * 0.5, height * 0.5).value(),
      std::move(*motion), Renderer()});
}

/// Root of the mean square of the differences where both are valid.
double rms_between(const FrameLayer& a, const FrameLayer& b) {
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < a.samples.size(); ++i) {
    const std::size_t pixel = i / static_cast<std::size_t>(a.bands);
    if (!a.validity[pixel] || !b.validity[pixel]) continue;
    const double d = static_cast<double>(a.samples[i]) - static_cast<double>(b.samples[i]);
    sum += d * d;
    ++count;
  }
  return std::sqrt(sum / count);
}

Method exposed(const std::shared_ptr<Flight>& flight, const std::shared_ptr<const Frame>& reference,
               const Shutter& shutter, double step_px, const std::string& setting) {
  const auto frame = std::make_shared<std::optional<Frame>>();
  return {
      .name = "nadir",
      .setting = setting,
      .run = [=]() -> Result<void> {
        auto made = flight->renderer.render(flight->scene, flight->camera, flight->motion, shutter,
                                            {.motion_step_px = step_px});
        if (!made) return fail(made);
        *frame = std::move(*made);
        return {};
      },
      .error = [=]() -> Result<double> { return rms_between((*frame)->layer(), reference->layer()); },
      .counters = [=]() -> std::map<std::string, std::string> {
        const auto& exposure = (*frame)->truth().exposure;
        if (!exposure) return {{"poses", "1"}};
        return {{"poses", std::to_string(exposure->poses)}, {"motion_px", fmt::format("{:.1f}", exposure->motion_px)}};
      }};
}

Case blur(double exposure_s, const RunOptions& options) {
  return {fmt::format("exposure of {:g} ms", exposure_s * 1e3), [=]() -> Result<Comparison> {
            const auto drone = flight(options.quick);
            if (!drone) return fail(drone);
            const Shutter shutter{.exposure_s = exposure_s};
            auto made = (*drone)->renderer.render((*drone)->scene, (*drone)->camera, (*drone)->motion, shutter,
                                                  {.motion_step_px = options.quick ? 1.0 : 0.2});
            if (!made) return fail(made);
            const auto reference = std::make_shared<const Frame>(std::move(*made));
            Comparison comparison{.error_unit = "DN"};
            comparison.methods.push_back(exposed(*drone, reference, {}, 2, "no exposure"));
            for (const double step : {16.0, 8.0, 4.0, 2.0, 1.0})
              comparison.methods.push_back(exposed(*drone, reference, shutter, step, fmt::format("{:g} px", step)));
            comparison.aims = {{.method = label("nadir", "2 px"), .baseline = label("nadir", "no exposure")}};
            return comparison;
          }};
}

Case rolling(const RunOptions& options) {
  return {"rolling shutter of 20 ms", [=]() -> Result<Comparison> {
            const auto drone = flight(options.quick);
            if (!drone) return fail(drone);
            const Shutter shutter{.readout_s = 0.02};
            auto made = (*drone)->renderer.render((*drone)->scene, (*drone)->camera, (*drone)->motion, shutter,
                                                  {.geometry_tolerance_px = 1e-3});
            if (!made) return fail(made);
            const auto reference = std::make_shared<const Frame>(std::move(*made));
            Comparison comparison{.error_unit = "DN"};
            comparison.methods = {exposed(*drone, reference, {}, 2, "global"),
                                  exposed(*drone, reference, shutter, 2, "rolling")};
            comparison.aims = {{.method = label("nadir", "rolling"), .baseline = label("nadir", "global")}};
            return comparison;
          }};
}

}  // namespace

Suite motion_suite() {
  return {"motion", "exposures of a moving camera: error against run time over the step between poses",
          [](const RunOptions& options) {
            return std::vector<Case>{blur(0.01, options), blur(0.05, options), rolling(options)};
          }};
}

}  // namespace nadir::bench
