#include "original.h"

#include <algorithm>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "must.h"

namespace nadir::bench {

std::optional<OriginalFootprint> Original::footprint(const render::Camera& camera,
                                                     const EnuFromCamera& enu_from_camera) const {
  const double w = camera.width_px(), h = camera.height_px();
  const std::array<Eigen::Vector3d, 4> corners = {Eigen::Vector3d(0, 0, 1), {w, 0, 1}, {0, h, 1}, {w, h, 1}};
  OriginalFootprint seen;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d from = enu_from_camera.origin;
    const Eigen::Vector3d ray = enu_from_camera.rotation * (camera.ray_from_image() * corners[i]);
    const Eigen::Vector3d hit = from - ray * (from.z() / ray.z());  // behind the camera counts too, as in the original
    const double u = (hit.x() + plane_m_.x() / 2) / plane_m_.x(), v = (plane_m_.y() / 2 - hit.y()) / plane_m_.y();
    if (!(u >= 0 && u <= 1 && v >= 0 && v <= 1)) return std::nullopt;
    seen.world_m[i] = hit.head<2>();
    seen.reference_px[i] = {u * reference_.cols, v * reference_.rows};
  }
  return seen;
}

cv::Rect2f Original::its_rectangle(const render::Camera& camera) {
  return {0, 0, static_cast<float>(camera.width_px() - 1), static_cast<float>(camera.height_px() - 1)};
}

cv::Mat Original::sensor_from_reference(const std::array<Eigen::Vector2d, 4>& reference_px, const cv::Rect2f& s) {
  const std::array<cv::Point2f, 4> to = {s.tl(), {s.x + s.width, s.y}, {s.x, s.y + s.height}, s.br()};
  std::array<cv::Point2f, 4> from;
  for (std::size_t i = 0; i < 4; ++i)
    from[i] = {static_cast<float>(reference_px[i].x()), static_cast<float>(reference_px[i].y())};
  return cv::getPerspectiveTransform(from.data(), to.data());
}

cv::Mat Original::picture(const cv::Mat& sensor_from_reference, const render::Camera& camera) const {
  cv::Mat out;
  cv::warpPerspective(reference_, out, sensor_from_reference, {camera.width_px(), camera.height_px()});
  return out;
}

cv::Mat Original::truth_picture(const OriginalFootprint& footprint) const {
  cv::Mat copy = reference_.clone();
  std::vector<cv::Point> around;
  for (const std::size_t i : {0, 1, 3, 2})
    around.emplace_back(cvRound(footprint.reference_px[i].x()), cvRound(footprint.reference_px[i].y()));
  cv::fillPoly(copy, std::vector<std::vector<cv::Point>>{around}, {0, 255, 0});
  return copy;
}

EnuFromCamera level(double east_m, double north_m, double height_m) {
  // Image right is east, image down is south, the optical axis is down: half a turn about east.
  return {Eigen::Quaterniond(0, 1, 0, 0), {east_m, north_m, height_m}};
}

cv::Mat read_bgr(const tile::Map& map) {
  cv::Mat reference(map.height(), map.width(), CV_8UC3);
  const std::array bands = {3, 2, 1};
  constexpr std::int32_t strip = 512;
  for (std::int32_t y = 0; y < map.height(); y += strip) {
    const std::int32_t rows = std::min(strip, map.height() - y);
    const tile::Texels texels = must(map.read(0, {0, y, map.width(), rows}, bands));
    std::memcpy(reference.ptr(y), texels.samples.data(), texels.samples.size());
  }
  return reference;
}

Eigen::Vector2d plane_of_map_units(const tile::Map& map) {
  const Eigen::Vector2d across = map.crs_from_texel().linear() * Eigen::Vector2d(map.width(), map.height());
  return across.cwiseAbs();
}

Eigen::Vector2d plane_of_true_metres(const tile::Map& map) {
  return map.texel_size_m().cwiseProduct(Eigen::Vector2d(map.width(), map.height()));
}

}  // namespace nadir::bench
