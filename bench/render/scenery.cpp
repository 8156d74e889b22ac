#include "scenery.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "builders.h"
#include "nadir/bench/measure.h"
#include "nadir/geodesy/attitude.h"
#include "nadir/render/renderer.h"

namespace nadir::bench {
namespace {

namespace fs = std::filesystem;

constexpr double yaw_deg = 4;          // more, and n8 would leave its map
constexpr double focal_per_width = 2;  // 28 degrees across: o75 then ends 5 degrees below the horizon

std::string type_name(SampleType type) {
  return type == SampleType::u8 ? "u8" : type == SampleType::u16 ? "u16" : "f32";
}

/// UTM zone 33, the map's middle on the central meridian, where the zone is truest.
MapRule rule_of(const MapKind& kind, std::int64_t side, std::shared_ptr<const RepeatedContent> content) {
  MapRule rule;
  rule.width = rule.height = side;
  rule.bands = kind.bands;
  rule.type = kind.type;
  rule.tile_size = build_tile_side;
  rule.texel = usual_texel_m;
  rule.west = 500'000 - usual_texel_m * static_cast<double>(side) / 2;
  rule.north = 5'400'000 + usual_texel_m * static_cast<double>(side) / 2;
  rule.content = std::move(content);
  rule.texture = true;
  return rule;
}

}  // namespace

std::vector<Pose> poses() {
  return {{"n1", 1, 0}, {"n8", 8, 0}, {"n64", 64, 0, true}, {"o45", 1, 45}, {"o75", 1, 75}, {"low4", 0.25, 0}};
}

Result<View> view_of(const Pose& pose, int width, int height, const tile::Map& map, double texel_m, double right_px,
                     double down_px) {
  View view{.name = pose.name, .width = width, .height = height, .focal_px = focal_per_width * width};
  const double yaw = geodesy::to_radians(yaw_deg), pitch = geodesy::to_radians(pose.pitch_deg);
  const Eigen::Vector3d forward(std::sin(yaw), std::cos(yaw), 0), up = Eigen::Vector3d::UnitZ();
  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> rotation;
  rotation.col(2) = std::sin(pitch) * forward - std::cos(pitch) * up;
  rotation.col(0) = forward.cross(up);
  rotation.col(1) = rotation.col(2).cross(rotation.col(0));
  const double pixel_m = texel_m * pose.texels;
  const Eigen::Vector3d camera =
      -view.focal_px * pixel_m * rotation.col(2) + pixel_m * (right_px * rotation.col(0) + down_px * rotation.col(1));
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(view.enu_from_camera.data()) = rotation;
  Eigen::Map<Eigen::Vector3d>(view.camera_enu_m.data()) = camera;

  const auto scene = render::Scene::plane(map.center(), {});
  const auto device = render::Camera::pinhole(width, height, view.focal_px, view.focal_px, width / 2.0, height / 2.0);
  if (!device) return fail(device);
  const geodesy::Pose<geodesy::frame::Enu, geodesy::frame::Camera> enu_from_camera{
      Eigen::Quaterniond(Eigen::Matrix3d(rotation)), camera};
  const render::ExactChain chain(*device, scene.surface().frame().ecef_from_enu() * enu_from_camera, scene.surface());
  const render::Truth truth = render::geometric_truth(chain, map);
  if (!truth.map_pixel_from_image_pixel)
    return fail(Error::Kind::OutsideMap,
                fmt::format("{}: a corner of {} x {} pixels sees no ground", pose.name, width, height));
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(view.map_pixel_from_image_pixel.data()) =
      *truth.map_pixel_from_image_pixel;
  view.homography_error_px = truth.homography_max_error_px.value_or(0);
  for (const double u : {-0.5, width - 0.5})
    for (const double v : {-0.5, height - 0.5}) {
      const MapPoint corner = map_point(view.map_pixel_from_image_pixel, u, v);
      if (!(corner.x >= 0 && corner.y >= 0 && corner.x <= map.width() - 1 && corner.y <= map.height() - 1))
        return fail(Error::Kind::OutsideMap,
                    fmt::format("{}: {} x {} pixels see texel {:.0f}, {:.0f} of a map of {} x {}", pose.name, width,
                                height, corner.x, corner.y, map.width(), map.height()));
    }
  return view;
}

const MapContent& Scenery::content() const {
  if (!content_) content_ = MapContent::make(quick_ ? 1024 : 2048, kind_.bands, kind_.type);
  return *content_;
}

std::string Scenery::file(const std::string& what, std::int64_t side) const {
  return (folder_ / fmt::format("{}_{}x{}_{}.tif", what, type_name(kind_.type), kind_.bands, side)).string();
}

Result<std::string> Scenery::repeated(std::int64_t side) const {
  if (side == 0) side = kind_.side;
  const std::string path = file("repeated", side);
  if (fs::exists(path)) return path;
  if (!repeated_)
    repeated_ = std::make_shared<const RepeatedContent>(content().texels, content().scene.side(), kind_.bands,
                                                        kind_.type != SampleType::f32);
  if (const auto written = write_map(path, rule_of(kind_, side, repeated_)); !written) return fail(written);
  return path;
}

Result<std::string> Scenery::built(const std::string& codec) const {
  const std::string path = file(codec, kind_.side);
  if (fs::exists(path)) return path;
  const auto source = repeated();
  if (!source) return fail(source);
  const BuildPacking packing{.codec = codec == "zstd" ? BuildCodec::zstd : BuildCodec::none, .level = 3};
  const Method builder = nadir_method(NadirBuild::find(), *source, path, packing);
  if (!builder.left_out.empty()) return fail(Error::Kind::NotFound, builder.left_out);
  if (const auto done = measure_command(builder.command); !done) return fail(done);
  return path;
}

}  // namespace nadir::bench
