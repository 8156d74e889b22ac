#include "nadir/record/overview.h"
#include "nadir/base/time.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nadir/record/image_files.h"

namespace nadir::record {
namespace {

using namespace geodesy;

constexpr std::size_t most_shown = 24, most_path_points = 2000;
constexpr int thumbnail_width = 320, picture_side = 1000;

/// The scene with one of its layers.
render::Scene only(const render::Scene& scene, const render::Layer& layer) {
  return render::Scene::over(scene.surface()).with_layer(layer.name, layer.source->map(), layer.options);
}

SheetFrame sheet_frame(const render::FrameLayer& layer, const render::Layer& of, std::string caption) {
  return {{layer.samples.data(), layer.type, layer.width, layer.height, layer.bands},
          std::move(caption),
          layer.validity,
          of.source->domain() == tile::Domain::Decibel && !of.options.output};
}

std::string seconds(std::int64_t time_ns) { return fmt::format("{:.2f} s", seconds_from_ns(time_ns)); }

/// The plane of overviews: the scene's own, else the one that touches the Earth at the scene origin.
render::Plane plan_plane(const render::Surface& surface) {
  return surface.plane() ? *surface.plane() : render::Plane(surface.frame().origin(), surface.height_m());
}

/// A camera looking straight down at a box of the plane, north up: the plane's picture is then similar to the plane.
struct PlanView {
  PlanView(const render::Plane& plane, const Eigen::AlignedBox2d& box_m) : centre_m(box_m.center()) {
    const Eigen::Vector2d size_m = box_m.sizes();
    metres_per_pixel = size_m.maxCoeff() / picture_side;
    width = std::clamp(static_cast<int>(std::lround(size_m.x() / metres_per_pixel)), picture_side / 4, picture_side);
    height = std::clamp(static_cast<int>(std::lround(size_m.y() / metres_per_pixel)), picture_side / 4, picture_side);
    constexpr double focal_px = 10 * picture_side;
    camera_pose =
        plane.frame().ecef_from_enu() *
        Pose<frame::Enu, frame::Camera>{Eigen::Quaterniond(0, 1, 0, 0),
                                        {centre_m.x(), centre_m.y(), plane.up_m() + focal_px * metres_per_pixel}};
    focal = focal_px;
  }
  PicturePoint picture(const Eigen::Vector2d& east_north_m) const {
    const Eigen::Vector2d offset = (east_north_m - centre_m) / metres_per_pixel;
    return {width * 0.5 + offset.x(), height * 0.5 - offset.y()};
  }
  std::vector<PicturePoint> picture(const std::vector<Eigen::Vector2d>& points_m) const {
    std::vector<PicturePoint> points;
    for (const auto& p : points_m) points.push_back(picture(p));
    return points;
  }
  Eigen::Vector2d centre_m;
  double metres_per_pixel = 1, focal = 1;
  int width = 1, height = 1;
  render::CameraPose camera_pose;
};

}  // namespace

Overview::Overview(const render::Scene& scene, const render::Camera& camera, std::size_t frames_to_come)
    : scene_(scene),
      camera_(camera),
      path_stride_(frames_to_come / most_path_points + 1),
      shown_stride_((frames_to_come + most_shown - 1) / most_shown) {
  shown_stride_ = std::max<std::size_t>(shown_stride_, 1);
}

void Overview::plan(std::vector<Eigen::Vector2d> north_east_m) {
  plan_m_ = std::move(north_east_m);
  for (Eigen::Vector2d& p : plan_m_) p = p.reverse().eval();
}

void Overview::add(const render::Truth& truth, std::int64_t time_ns) {
  const std::size_t index = added_++;
  if (index % path_stride_ == 0) path_m_.emplace_back(truth.enu_from_camera.origin.head<2>());
  if (index % shown_stride_ != 0) return;
  Seen seen{time_ns, truth.ecef_from_camera, {}};
  for (const auto& lon_lat : truth.footprint.outline_lon_lat_rad)
    if (const auto point = plan_plane(scene_.surface()).at(lon_lat.x(), lon_lat.y()))
      seen.outline_m.emplace_back(point->xyz.head<2>());
  shown_.push_back(std::move(seen));
}

Result<void> Overview::write_contact_sheet(render::Renderer& renderer, const render::Layer& layer,
                                           const std::filesystem::path& path) const {
  const auto images = image_files();
  if (!images) return fail(images);
  const double scale = std::min(1.0, static_cast<double>(thumbnail_width) / camera_.width_px());
  const auto small = [&](int size_px) { return std::max(1, static_cast<int>(std::lround(size_px * scale))); };
  const Eigen::Vector2d principal_px = camera_.principal_point_px() * scale;
  const auto thumbnail =
      render::Camera::pinhole(small(camera_.width_px()), small(camera_.height_px()), camera_.fx_px() * scale,
                              camera_.fy_px() * scale, principal_px.x(), principal_px.y());
  if (!thumbnail) return fail(thumbnail);

  std::vector<render::Frame> frames;
  for (const Seen& seen : shown_) {
    auto frame = renderer.render(only(scene_, layer), thumbnail->with_lens(camera_.lens()), seen.ecef_from_camera);
    if (!frame) return fail(frame);
    frames.push_back(std::move(*frame));
  }
  ContactSheet sheet{fmt::format("{}: {} of {} frames", layer.name, shown_.size(), added_), {}};
  for (std::size_t i = 0; i < frames.size(); ++i)
    sheet.frames.push_back(sheet_frame(frames[i].layer(), layer, seconds(shown_[i].time_ns)));
  if (auto written = (*images)->write_contact_sheet(path, sheet); !written) return fail(written);
  return {};
}

Result<void> Overview::write_footprints(render::Renderer& renderer, const render::Layer& layer,
                                        const std::filesystem::path& path) const {
  const auto images = image_files();
  if (!images) return fail(images);

  // What was seen and flown over, as far as it lies near the map: an oblique view reaches to the horizon
  Eigen::AlignedBox2d box;
  for (const Seen& seen : shown_)
    for (const auto& p : seen.outline_m) box.extend(p);
  const render::Plane plane = plan_plane(scene_.surface());
  const tile::Map& shown_map = layer.source->map();
  const render::GroundExtent extent = render::ground_extent(plane, shown_map.projection(), shown_map.crs_from_texel(),
                                                            shown_map.width(), shown_map.height());
  if (extent.bounded) box = box.intersection(extent.box);
  for (const auto* points_m : {&path_m_, &plan_m_})
    for (const auto& p : *points_m) box.extend(p);
  const double margin_m = 0.06 * box.sizes().maxCoeff() + 1e-3;
  box.min().array() -= margin_m;
  box.max().array() += margin_m;

  const PlanView view(plane, box);
  const auto camera =
      render::Camera::pinhole(view.width, view.height, view.focal, view.focal, view.width * 0.5, view.height * 0.5);
  if (!camera) return fail(camera);
  const auto frame = renderer.render(
      render::Scene::over(plane).with_layer(layer.name, layer.source->map(), layer.options), *camera, view.camera_pose);
  if (!frame) return fail(frame);

  FootprintMap map;
  map.background = sheet_frame(frame->layer(), layer, "");
  for (const Seen& seen : shown_) map.footprints.push_back(view.picture(seen.outline_m));
  map.path = view.picture(path_m_);
  map.plan = view.picture(plan_m_);
  map.metres_per_pixel = view.metres_per_pixel;
  const tile::MapDescription& description = layer.source->map().description();
  map.title = fmt::format("{}: camera path and {} of {} footprints", layer.name, shown_.size(), added_);
  map.attribution = description.attribution;
  if (!shown_.empty()) {
    map.first_label = seconds(shown_.front().time_ns);
    map.last_label = seconds(shown_.back().time_ns);
  }
  if (auto written = (*images)->write_footprint_map(path, map); !written) return fail(written);
  return {};
}

}  // namespace nadir::record
