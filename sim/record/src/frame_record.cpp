#include "nadir/record/frame_record.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <nlohmann/json.hpp>

#include "nadir/render/geographic_polygon.h"

namespace nadir::record {
namespace {

using Json = nlohmann::ordered_json;
using geodesy::to_degrees;
constexpr int format_version = 1;

Json vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Json vector(const Eigen::Vector2d& v) { return {v.x(), v.y()}; }
Json degrees(const Eigen::Vector2d& lon_lat_rad) { return {to_degrees(lon_lat_rad.x()), to_degrees(lon_lat_rad.y())}; }
Json quaternion(const Eigen::Quaterniond& q) { return {{"w", q.w()}, {"x", q.x()}, {"y", q.y()}, {"z", q.z()}}; }

Json matrix(const Eigen::Matrix3d& m) {
  Json rows = Json::array();
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) rows.push_back(m(r, c));
  return rows;
}

template <class T, class Convert>
Json or_null(const std::optional<T>& value, Convert&& convert) {
  return value ? Json(convert(*value)) : Json(nullptr);
}
template <class T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json pose(const render::Truth& t) {
  return {
      {"lat_deg", to_degrees(t.position.lat_rad)},   {"lon_deg", to_degrees(t.position.lon_rad)},
      {"height_ellipsoid_m", t.position.height_m},   {"height_agl_m", t.height_agl_m},
      {"ecef_m", vector(t.ecef_from_camera.origin)}, {"ecef_from_camera_quat", quaternion(t.ecef_from_camera.rotation)},
      {"enu_m", vector(t.enu_from_camera.origin)},   {"enu_from_camera_quat", quaternion(t.enu_from_camera.rotation)},
      {"yaw_deg", to_degrees(t.attitude.yaw_rad)},   {"pitch_deg", to_degrees(t.attitude.pitch_rad)},
      {"roll_deg", to_degrees(t.attitude.roll_rad)}};
}

Json exposure(const render::Exposure& exposure) {
  const auto placed = [](const render::CameraPose& pose) {
    return Json{{"ecef_m", vector(pose.origin)}, {"ecef_from_camera_quat", quaternion(pose.rotation)}};
  };
  return {{"exposure_s", exposure.shutter.exposure_s},
          {"readout_s", exposure.shutter.readout_s},
          {"motion_px", exposure.motion_px},
          {"poses", exposure.poses},
          {"start", placed(exposure.ecef_from_camera_at_start)},
          {"end", placed(exposure.ecef_from_camera_at_end)}};
}

/// GeoJSON.
Json geometry(const render::Footprint& footprint) {
  Json polygons = Json::array();
  for (const render::GeographicPolygon& polygon : render::geographic_polygons(footprint)) {
    Json rings = Json::array();
    for (const render::GeographicRing& ring : polygon) {
      Json positions = Json::array();
      for (const Eigen::Vector2d& p : ring) positions.push_back(vector(p));
      rings.push_back(std::move(positions));
    }
    polygons.push_back(std::move(rings));
  }
  if (polygons.empty()) return nullptr;
  if (polygons.size() == 1) return {{"type", "Polygon"}, {"coordinates", polygons[0]}};
  return {{"type", "MultiPolygon"}, {"coordinates", polygons}};
}

Json footprint(const render::Truth& t) {
  Json texel = Json::array(), uv = Json::array(), enu = Json::array(), lon_lat = Json::array(), outline = Json::array();
  for (std::size_t i = 0; i < 4; ++i) {
    texel.push_back(or_null(t.footprint_texel[i], [](const Eigen::Vector2d& v) { return vector(v); }));
    uv.push_back(or_null(t.footprint_uv[i], [](const Eigen::Vector2d& v) { return vector(v); }));
    const auto& corner = t.footprint.corners[i];
    enu.push_back(or_null(corner, [](const render::GroundPoint& p) { return vector(p.enu_m); }));
    lon_lat.push_back(or_null(corner, [](const render::GroundPoint& p) { return degrees(p.lon_lat_rad); }));
  }
  for (const auto& p : t.footprint.outline_lon_lat_rad) outline.push_back(degrees(p));
  return {{"texel", texel},
          {"uv", uv},
          {"enu_m", enu},
          {"lon_lat_deg", lon_lat},
          {"outline_lon_lat_deg", outline},
          {"geometry", geometry(t.footprint)}};
}

Json settings(const render::Truth& t) {
  Json levels = Json::array();
  for (int k = t.finest_level; k <= t.coarsest_level && t.tiles > 0; ++k) levels.push_back(k);
  return {{"quality", render::to_string(t.quality)},
          {"levels", levels},
          {"filter", render::to_string(t.filter)},
          {"oversampling", t.oversampling},
          {"adaptive", t.adaptive},
          {"tiles", t.tiles},
          {"undersampled", t.undersampled},
          {"coarse", or_null(t.coarse, [](const render::CoarseFill& c) {
             return Json{{"fraction", c.fraction}, {"levels", c.levels}};
           })}};
}

Json head(const FrameFile& file) {
  return {{"format_version", format_version},
          {"file", file.file.empty() ? Json(nullptr) : Json(file.file)},
          {"mask_file", file.mask_file.empty() ? Json(nullptr) : Json(file.mask_file)},
          {"truth_planes", file.truth_planes.empty() ? Json(nullptr) : Json(file.truth_planes)},
          {"vehicle", file.vehicle},
          {"sensor", file.sensor},
          {"time_ns", file.time_ns}};
}

std::string line(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

}  // namespace

struct Checksum::State {
  State() : xxh3(XXH3_createState()) { XXH3_64bits_reset(xxh3.get()); }
  struct Free {
    void operator()(XXH3_state_t* s) const { XXH3_freeState(s); }
  };
  std::unique_ptr<XXH3_state_t, Free> xxh3;
};

Checksum::Checksum() : state_(std::make_unique<State>()) {}
Checksum::~Checksum() = default;
Checksum::Checksum(Checksum&&) noexcept = default;
Checksum& Checksum::operator=(Checksum&&) noexcept = default;

void Checksum::add(std::span<const std::byte> bytes) {
  XXH3_64bits_update(state_->xxh3.get(), bytes.data(), bytes.size());
}
std::string Checksum::text() const { return fmt::format("xxh3:{:016x}", XXH3_64bits_digest(state_->xxh3.get())); }

std::string checksum(const render::FrameLayer& layer) {
  Checksum sum;
  sum.add(layer.samples);
  sum.add(std::as_bytes(std::span(layer.validity)));
  return sum.text();
}

std::string frame_record(const FrameFile& file, const render::FrameLayer& layer) {
  return frame_record(file, layer, checksum(layer));
}

std::string frame_record(const FrameFile& file, const render::FrameLayer& layer, const std::string& checksum) {
  const render::Truth& t = layer.truth;
  Json json = head(file);
  json["width"] = layer.width;
  json["height"] = layer.height;
  json["bands"] = layer.bands;
  json["type"] = tile::to_string(layer.type);
  json["pose"] = pose(t);
  json["exposure"] = or_null(t.exposure, exposure);
  json["camera_matrix"] = matrix(t.camera_matrix);
  json["distortion_model"] = render::to_string(t.lens.model());
  json["distortion"] = t.lens.ideal() ? Json(Json::array()) : Json(t.lens.coefficients());
  json["map"] = {{"path", t.map_path},
                 {"crs", t.map_crs},
                 {"gsd_m", t.map_gsd_m},
                 {"acquired", t.map_acquired.empty() ? Json(nullptr) : Json(t.map_acquired)}};
  json["map_pixel_from_image_pixel"] = or_null(t.map_pixel_from_image_pixel, matrix);
  json["image_pixel_from_map_pixel"] = or_null(t.image_pixel_from_map_pixel, matrix);
  json["homography_max_error_px"] = or_null(t.homography_max_error_px);
  json["footprint"] = footprint(t);
  json["valid_fraction"] = t.valid_fraction;
  json["damage"] = t.damage;
  json["image_gsd_m"] = or_null(t.image_gsd_m);
  json["magnification"] = or_null(t.magnification);
  json["map_resolution_limited"] = or_null(t.magnification, [](double m) { return m > 1; });
  json["settings"] = settings(t);
  json["expected_error"] = {{"geometry_px", t.geometry_error_px}, {"resampling_dn", or_null(t.expected_rmse)}};
  json["render_ms"] = t.render_ms;
  json["checksum"] = checksum;
  return line(json);
}

std::string footprint_feature(const FrameFile& file, const render::FrameLayer& layer) {
  const render::Truth& t = layer.truth;
  return line({{"type", "Feature"},
               {"geometry", geometry(t.footprint)},
               {"properties",
                {{"file", file.file},
                 {"vehicle", file.vehicle},
                 {"sensor", file.sensor},
                 {"time_ns", file.time_ns},
                 {"lat_deg", to_degrees(t.position.lat_rad)},
                 {"lon_deg", to_degrees(t.position.lon_rad)},
                 {"height_ellipsoid_m", t.position.height_m},
                 {"height_agl_m", t.height_agl_m},
                 {"yaw_deg", to_degrees(t.attitude.yaw_rad)},
                 {"pitch_deg", to_degrees(t.attitude.pitch_rad)},
                 {"roll_deg", to_degrees(t.attitude.roll_rad)},
                 {"image_gsd_m", or_null(t.image_gsd_m)},
                 {"valid_fraction", t.valid_fraction},
                 {"map", t.map_path}}}});
}

std::string rejected_frame_record(const FrameFile& file, const std::string& reason) {
  Json json = head(file);
  json["rejected"] = reason;
  return line(json);
}

}  // namespace nadir::record
