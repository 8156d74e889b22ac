#include "convergence.h"

#include <fmt/format.h>

#include <cmath>

namespace nadir::bench {
namespace {

constexpr std::int64_t map_side = 2048;

Case convergence(const RunOptions& options, const Pose& pose) {
  return {"convergence, " + pose.name, [=]() -> Result<Comparison> {
            RunOptions in_full = options;
            in_full.quick = false;
            const auto view =
                options.quick ? FineView::make(in_full, pose, 64, 48) : FineView::make(in_full, pose, 160, 120);
            if (!view) return fail(view);
            const auto finest = (*view)->render(reference_with(finest_reference));
            if (!finest) return fail(finest);
            Comparison comparison{.error_unit = "of 255, RMS", .warm_up = false, .rounds = 1};
            const auto add = [&](const std::string& name, const std::string& setting,
                                 const render::RenderOptions& how) {
              const auto frame = std::make_shared<std::vector<float>>();
              Method method{.name = name, .setting = setting};
              method.run = [=, view = *view]() -> Result<void> {
                auto rendered = view->render(how);
                if (!rendered) return fail(rendered);
                *frame = std::move(*rendered);
                return {};
              };
              method.error = [=, finest = *finest]() -> Result<double> { return difference(*frame, finest); };
              comparison.methods.push_back(std::move(method));
            };
            for (const double samples : {2.0, 4.0, 8.0})
              add("reference", fmt::format("{} samples a texel", samples), reference_with(samples));
            for (const auto quality : {render::Quality::draft, render::Quality::balanced, render::Quality::best})
              add("nadir " + std::string(to_string(quality)), "", {.quality = quality});
            return comparison;
          }};
}

}  // namespace

FineView::FineView(const tile::Map& map, render::Camera camera, const View& view)
    : scene_(render::Scene::plane(map.center(), {}).with_layer("map", map)), camera_(std::move(camera)) {
  using Rotation = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const geodesy::Pose<geodesy::frame::Enu, geodesy::frame::Camera> enu_from_camera{
      Eigen::Quaterniond(Eigen::Map<const Rotation>(view.enu_from_camera.data())),
      Eigen::Map<const Eigen::Vector3d>(view.camera_enu_m.data())};
  pose_ = scene_.surface().frame().ecef_from_enu() * enu_from_camera;
}

Result<std::shared_ptr<FineView>> FineView::make(const RunOptions& options, const Pose& pose, int width, int height) {
  const auto path = Scenery(options, {SampleType::f32, 1, map_side}).repeated();
  if (!path) return fail(path);
  const auto map = tile::Map::open(*path);
  if (!map) return fail(map);
  const auto view = view_of(pose, width, height, *map);
  if (!view) return fail(view);
  auto camera = render::Camera::pinhole(width, height, view->focal_px, view->focal_px, width / 2.0, height / 2.0);
  if (!camera) return fail(camera);
  return std::shared_ptr<FineView>(new FineView(*map, std::move(*camera), *view));
}

Result<std::vector<float>> FineView::render(const render::RenderOptions& options) {
  const auto frame = renderer_.render(scene_, camera_, pose_, options);
  if (!frame) return fail(frame);
  const auto pixels = frame->pixels<float>();
  return std::vector<float>(pixels.begin(), pixels.end());
}

render::RenderOptions reference_with(double samples_a_texel) {
  return {.filter = render::Filter::Reference, .oversampling = samples_a_texel};
}

double difference(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(static_cast<double>(a[i]) - b[i], 2);
  return 255 * std::sqrt(sum / static_cast<double>(a.size()));
}

std::vector<Case> convergence_cases(const RunOptions& options) {
  std::vector<Case> cases;
  for (const Pose& pose : poses())
    if (!pose.wide) cases.push_back(convergence(options, pose));
  return cases;
}

}  // namespace nadir::bench
