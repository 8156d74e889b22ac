#include "nadir/render/truth.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "nadir/render/homography.h"

namespace nadir::render {
using namespace geodesy;
namespace {

/// A texel on the turn nearest to `x`, where the map goes around the Earth.
Eigen::Vector2d on_turn_of(double x, Eigen::Vector2d texel, const tile::Map& map) {
  if (map.goes_around()) texel.x() = x + std::remainder(texel.x() - x, map.width());
  return texel;
}

/// Greatest backward error of a homography over a grid, in image pixels; empty where the exact chain has no point.
std::optional<double> homography_error_px(const ExactChain& chain, const tile::Map& map,
                                          const Eigen::Matrix3d& texel_from_image) {
  constexpr int steps = 8;
  std::vector<Eigen::Vector2d> image;
  for (int j = 0; j <= steps; ++j)
    for (int i = 0; i <= steps; ++i)
      image.emplace_back(chain.camera().width_px() * (static_cast<double>(i) / steps),
                         chain.camera().height_px() * (static_cast<double>(j) / steps));
  std::vector<Eigen::Vector2d> crs(image.size());
  chain.crs_from_image(map.projection(), image, crs);
  double worst = 0;
  for (std::size_t i = 0; i < image.size(); ++i) {
    const Eigen::Vector2d found = apply(texel_from_image, image[i]);
    const Eigen::Vector2d error = on_turn_of(found.x(), map.texel_from_crs() * crs[i], map) - found;
    const double backward = (jacobian(texel_from_image, image[i]).inverse() * error).norm();
    if (!std::isfinite(backward)) return std::nullopt;
    worst = std::max(worst, backward);
  }
  return worst;
}

void add_homographies(const ExactChain& chain, const tile::Map& map, Truth& truth) {
  std::array<Eigen::Vector2d, 4> texel;
  for (std::size_t i = 0; i < 4; ++i) {
    if (!truth.footprint_texel[i]) return;
    texel[i] = on_turn_of(truth.footprint_texel[0]->x(), *truth.footprint_texel[i], map);
  }
  const auto texel_from_image = homography_from_rectangle(truth.width, truth.height, texel);
  if (!texel_from_image) return;
  const auto error_px = homography_error_px(chain, map, *texel_from_image);
  const Eigen::Matrix3d image_from_texel = texel_from_image->inverse();
  if (!error_px || !image_from_texel.allFinite()) return;
  truth.map_pixel_from_image_pixel = with_centres_at_integers(*texel_from_image);
  truth.image_pixel_from_map_pixel = with_centres_at_integers(image_from_texel);
  truth.homography_max_error_px = error_px;
}

/// Side of a square of the area that a pixel at an image point covers; empty where that sees no ground.
std::optional<double> ground_sample_distance_m(const ExactChain& chain, const Eigen::Vector2d& image) {
  if (chain.flat()) {
    if (!(chain.visibility(image) > 0)) return std::nullopt;
    return std::sqrt(std::abs(jacobian(chain.plane_from_image(), image).determinant()));
  }
  // Central differences: the error is a third derivative's, below 1e-6 of it a pixel
  std::array<std::optional<Eigen::Vector3d>, 4> at;
  constexpr double half = 0.5;
  const std::array<Eigen::Vector2d, 4> steps = {Eigen::Vector2d(-half, 0), {half, 0}, {0, -half}, {0, half}};
  for (std::size_t i = 0; i < 4; ++i) {
    at[i] = chain.enu_from_image(image + steps[i]);
    if (!at[i]) return std::nullopt;
  }
  return std::sqrt((*at[1] - *at[0]).cross(*at[3] - *at[2]).norm());
}

}  // namespace

Truth geometric_truth(const ExactChain& chain, const tile::Map& map) {
  Truth truth;
  truth.ecef_from_camera = chain.ecef_from_camera();
  truth.enu_from_camera = chain.enu_from_camera();
  truth.position = geodetic_from_ecef({chain.ecef_from_camera().origin});
  const Eigen::Quaterniond ned_from_mount = ecef_from_ned(truth.position).rotation.conjugate() *
                                            chain.ecef_from_camera().rotation *
                                            mount_from_camera().quaternion.conjugate();
  truth.attitude = yaw_pitch_roll_from(ned_from_mount);
  truth.height_agl_m = chain.height_above_ground_m();
  truth.width = chain.camera().width_px();
  truth.height = chain.camera().height_px();
  truth.camera_matrix = chain.camera().ros_camera_matrix();
  truth.lens = chain.camera().lens();
  truth.map_path = map.description().path;
  truth.map_crs = map.projection().name();
  truth.map_acquired = map.description().acquired;
  truth.map_gsd_m = std::sqrt(map.texel_size_m().prod());

  truth.footprint = footprint(chain, map.projection());
  for (std::size_t i = 0; i < 4; ++i) {
    if (!truth.footprint.corners[i] || !truth.footprint.corners[i]->crs.allFinite()) continue;
    truth.footprint_texel[i] = map.texel_from_crs() * truth.footprint.corners[i]->crs;
    truth.footprint_uv[i] = truth.footprint_texel[i]->cwiseQuotient(Eigen::Vector2d(map.width(), map.height()));
  }
  if (chain.surface().plane()) add_homographies(chain, map, truth);

  const Eigen::Vector2d middle(truth.width * 0.5, truth.height * 0.5);
  if (const auto gsd_m = ground_sample_distance_m(chain, middle)) {
    truth.image_gsd_m = *gsd_m;
    truth.magnification = truth.map_gsd_m / *gsd_m;
  }
  return truth;
}

}  // namespace nadir::render
