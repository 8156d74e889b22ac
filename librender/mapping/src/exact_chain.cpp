#include "nadir/render/exact_chain.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

namespace nadir::render {
using namespace geodesy;

namespace {
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Sine of the smallest angle below the horizontal at which a plane counts as ground.
double smallest_sink(double above_m) { return above_m / ExactChain::plane_reach_m(above_m); }

/// Between two unit vectors, exact for small angles too.
double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}
}  // namespace

ExactChain::ExactChain(const Camera& camera, const CameraPose& ecef_from_camera, const Surface& surface)
    : camera_(camera),
      ecef_from_camera_(ecef_from_camera),
      surface_(surface),
      flat_(surface.plane() && camera.lens().ideal()),
      enu_from_camera_(surface.frame().enu_from_ecef() * ecef_from_camera) {
  if (camera.lens().ideal())
    enu_ray_from_image_ = enu_from_camera_.rotation.toRotationMatrix() * camera.ray_from_image();
  ground_ = ground_cone(ecef_from_camera_);
  smallest_sink_ = smallest_sink(ground_.above_m);
}

ExactChain::ExactChain(const Camera& camera, const CameraMotion& motion, const Shutter& shutter, const Surface& surface,
                       double of_exposure_s)
    : ExactChain(camera, motion.at(of_exposure_s), surface) {
  if (shutter.readout_s == 0) return;
  rolling_ = {motion, of_exposure_s, shutter.readout_s, static_cast<double>(camera.height_px())};
  flat_ = false;
  cone_shift_rad_ = greatest_cone_shift_rad();
}

std::vector<double> ExactChain::kinks() const {
  std::vector<double> rows;
  if (!rolling_) return rows;
  for (const double time_s :
       rolling_->motion.moments_between(rolling_->time_s(0), rolling_->time_s(rolling_->height_px)))
    rows.push_back(((time_s - rolling_->middle_s) / rolling_->readout_s + 0.5) * rolling_->height_px);
  return rows;
}

ExactChain::GroundCone ExactChain::ground_cone(const CameraPose& ecef_from_camera) const {
  GroundCone cone;
  if (const Plane* plane = surface_.plane()) {
    cone.above_m = (surface_.frame().enu_from_ecef() * ecef_from_camera).origin.z() - plane->up_m();
    cone.axis = -Eigen::Vector3d::UnitZ();
    if (cone.above_m > 0) cone.angle_rad = std::acos(smallest_sink(cone.above_m));
  } else {
    const Ellipsoid& ellipsoid = *surface_.ellipsoid();
    cone.above_m = geodetic_from_ecef({ecef_from_camera.origin}).height_m - ellipsoid.height_m();
    const Eigen::Vector3d from = ellipsoid.to_unit_sphere(ecef_from_camera.origin);
    cone.axis = -from.normalized();
    if (cone.above_m > 0) cone.angle_rad = std::asin(std::min(1.0, 1 / from.norm()));
  }
  return cone;
}

double ExactChain::greatest_cone_shift_rad() const {
  std::vector<double> rows = kinks();
  for (const double s : {0.0, 0.25, 0.5, 0.75, 1.0}) rows.push_back(s * rolling_->height_px);
  double shift = 0;
  for (const double row : rows) {
    const GroundCone cone = ground_cone(ecef_from_camera_at(row));
    if (!(cone.above_m > 0)) return std::numbers::pi;  // nothing is certain
    shift = std::max(shift, angle_between(cone.axis, ground_.axis) + std::abs(cone.angle_rad - ground_.angle_rad));
  }
  return 2 * shift;  // between those rows it is smooth, and small against a frame
}

/// A ray as a unit vector in the axes of the cone of rays that see ground.
Eigen::Vector3d ExactChain::towards_ground(const Eigen::Vector3d& camera_ray, const CameraPose& pose) const {
  if (const Ellipsoid* ellipsoid = surface_.ellipsoid())
    return ellipsoid->to_unit_sphere(pose.rotation * camera_ray).normalized();
  return ((surface_.frame().enu_from_ecef() * pose).rotation * camera_ray).normalized();
}

Eigen::Vector3d ExactChain::down() const {
  if (surface_.plane()) return enu_from_camera_.rotation.conjugate() * -Eigen::Vector3d::UnitZ();
  return ecef_from_camera_.rotation.conjugate() * -ecef_from_camera_.origin.normalized();
}

double ExactChain::visibility(const Eigen::Vector2d& image) const {
  if (!(ground_.above_m > 0) && !rolling_) return -1;
  if (flat_) return -enu_ray_from_image_.row(2).dot(image.homogeneous()) - smallest_sink_;
  return enu_from_image(image) ? 1 : -1;
}

Sight ExactChain::look(const Eigen::AlignedBox2d& rectangle) const {
  if (!(ground_.above_m > 0)) return rolling_ ? Sight::Some : Sight::None;
  if (flat_) {
    int seen = 0;
    for (const auto corner : {Eigen::AlignedBox2d::BottomLeft, Eigen::AlignedBox2d::BottomRight,
                              Eigen::AlignedBox2d::TopLeft, Eigen::AlignedBox2d::TopRight})
      seen += visibility(rectangle.corner(corner)) > 0 ? 1 : 0;
    return seen == 0 ? Sight::None : seen == 4 ? Sight::All : Sight::Some;
  }
  // Corners, edges and the middle
  std::array<std::optional<Eigen::Vector3d>, 9> rays;
  int found = 0;
  for (int i = 0; i < 9; ++i) {
    const Eigen::Vector2d at = rectangle.min() + rectangle.sizes().cwiseProduct(Eigen::Vector2d(i % 3, i / 3) / 2);
    rays[static_cast<std::size_t>(i)] = camera_.ray_of(at);
    found += rays[static_cast<std::size_t>(i)] ? 1 : 0;
  }
  if (found < 9) {
    // A lens fills a disc, but for a few percent by which tangential distortion dents it. All of the rectangle lies
    // beyond where its nearest point does, with a tenth to spare.
    const Eigen::Vector2d axis = camera_.principal_point_px();
    const Eigen::Vector2d nearest = axis.cwiseMax(rectangle.min()).cwiseMin(rectangle.max());
    return found == 0 && !camera_.ray_of(axis + 0.9 * (nearest - axis)) ? Sight::None : Sight::Some;
  }
  const Eigen::Vector3d middle = towards_ground(*rays[4], ecef_from_camera_);
  double spread = 0;
  for (const auto& ray : rays)
    spread = std::max(spread, angle_between(middle, towards_ground(*ray, ecef_from_camera_)));
  // Through an ideal lens the greatest angle is a corner's; others bend between the places looked at.
  if (!camera_.lens().ideal()) spread = 1.25 * spread + 1e-3;
  Eigen::Vector3d facing = middle;
  if (rolling_) {  // rows turn against the middle one
    const double first_s = rolling_->time_s(rectangle.min().y()), last_s = rolling_->time_s(rectangle.max().y());
    facing = towards_ground(*rays[4], ecef_from_camera_at(rectangle.center().y()));
    spread = 1.01 * (spread + rolling_->motion.turn_rad(first_s, last_s));  // on the unit sphere angles differ by 0.4 %
  }
  const double to_spare = 1e-4 + cone_shift_rad_;
  const double aside = angle_between(facing, ground_.axis);
  if (aside - spread > ground_.angle_rad + to_spare) return Sight::None;
  if (aside + spread < ground_.angle_rad - to_spare) return Sight::All;
  return Sight::Some;
}

Eigen::Matrix3d ExactChain::plane_from_image() const {
  assert(flat_);
  // The ray c + t d meets the plane at t = above / -d_z; east and north are c_xy + t d_xy, over the common denominator
  // -d_z.
  Eigen::Matrix3d h;
  h.row(2) = -enu_ray_from_image_.row(2);
  for (int axis = 0; axis < 2; ++axis)
    h.row(axis) = enu_from_camera_.origin[axis] * h.row(2) + ground_.above_m * enu_ray_from_image_.row(axis);
  return h;
}

std::optional<Eigen::Vector3d> ExactChain::plane_hit(const Plane& plane, const Eigen::Vector2d& image) const {
  Eigen::Vector3d ray;
  if (flat_) {
    if (!(visibility(image) > 0)) return std::nullopt;
    ray = enu_ray_from_image_ * image.homogeneous();
  } else {
    const auto camera_ray = camera_.ray_of(image);
    if (!camera_ray) return std::nullopt;
    if (rolling_) {
      const auto pose = surface_.frame().enu_from_ecef() * ecef_from_camera_at(image.y());
      ray = pose.rotation * *camera_ray;
      if (!(-ray.z() > smallest_sink(pose.origin.z() - plane.up_m()))) return std::nullopt;
      const auto point = plane.hit({pose.origin}, {ray});
      return point ? std::optional<Eigen::Vector3d>(point->xyz) : std::nullopt;
    }
    ray = enu_from_camera_.rotation * *camera_ray;
    if (!(-ray.z() > smallest_sink_)) return std::nullopt;
  }
  const auto point = plane.hit({enu_from_camera_.origin}, {ray});
  return point ? std::optional<Eigen::Vector3d>(point->xyz) : std::nullopt;
}

std::optional<Point<frame::Ecef>> ExactChain::ellipsoid_hit(const Eigen::Vector2d& image) const {
  const auto camera_ray = camera_.ray_of(image);
  if (!camera_ray) return std::nullopt;
  const CameraPose pose = ecef_from_camera_at(image.y());
  return surface_.ellipsoid()->hit({pose.origin}, {pose.rotation * *camera_ray});
}

std::optional<Eigen::Vector3d> ExactChain::enu_from_image(const Eigen::Vector2d& image) const {
  if (const Plane* plane = surface_.plane()) return plane_hit(*plane, image);
  const auto point = ellipsoid_hit(image);
  if (!point) return std::nullopt;
  return (surface_.frame().enu_from_ecef() * *point).xyz;
}

void ExactChain::lon_lat_from_image(std::span<const Eigen::Vector2d> image,
                                    std::span<Eigen::Vector2d> lon_lat_rad) const {
  assert(image.size() == lon_lat_rad.size());
  for (std::size_t i = 0; i < image.size(); ++i) {
    lon_lat_rad[i] = {nan, nan};
    std::optional<Point<frame::Ecef>> point;
    if (const Plane* plane = surface_.plane()) {
      if (const auto enu = plane_hit(*plane, image[i]))
        point = plane->frame().ecef_from_enu() * Point<frame::Enu>{*enu};
    } else {
      point = ellipsoid_hit(image[i]);
    }
    if (!point) continue;
    const Geodetic place = geodetic_from_ecef(*point);
    lon_lat_rad[i] = {place.lon_rad, place.lat_rad};
  }
}

void ExactChain::crs_from_image(const Projection& projection, std::span<const Eigen::Vector2d> image,
                                std::span<Eigen::Vector2d> crs) const {
  lon_lat_from_image(image, crs);
  projection.crs_from_lon_lat(crs);
}

}  // namespace nadir::render
