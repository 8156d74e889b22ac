#include "nadir/render/truth_planes.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <limits>

namespace nadir::render {
namespace {

using namespace geodesy;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Up at a point of the surface, in the scene's local frame.
Eigen::Vector3d normal_at(const Surface& surface, const Geodetic& place) {
  if (surface.plane()) return Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d down = ecef_from_ned(place).rotation * Eigen::Vector3d::UnitZ();
  return surface.frame().enu_from_ecef().rotation * -down;
}

std::vector<std::optional<Eigen::Vector3d>> corner_row(const ExactChain& chain, int y, int width) {
  std::vector<std::optional<Eigen::Vector3d>> row;
  for (int x = 0; x <= width; ++x) row.push_back(chain.enu_from_image({x, y}));
  return row;
}

void fill_row(const ExactChain& chain, int y, TruthPlanes& planes) {
  const auto above = corner_row(chain, y, planes.width), below = corner_row(chain, y + 1, planes.width);
  const Eigen::Vector3d camera = (chain.surface().frame().enu_from_ecef() * chain.ecef_from_camera_at(y + 0.5)).origin;
  for (int x = 0; x < planes.width; ++x) {
    const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(planes.width) + static_cast<std::size_t>(x);
    const auto left = static_cast<std::size_t>(x), right = left + 1;
    if (above[left] && above[right] && below[left] && below[right]) {
      const Eigen::Vector3d down = *below[right] - *above[left], up = *above[right] - *below[left];
      planes.ground_sample_distance_m[at] = static_cast<float>(std::sqrt(down.cross(up).norm() / 2));
    }
    const auto ground = chain.enu_from_image({x + 0.5, y + 0.5});
    if (!ground) continue;
    const Geodetic place = geodetic_from_ecef(chain.surface().frame().ecef_from_enu() * Point<frame::Enu>{*ground});
    const Eigen::Vector3d to_camera = camera - *ground, normal = normal_at(chain.surface(), place);
    planes.longitude_deg[at] = to_degrees(place.lon_rad);
    planes.latitude_deg[at] = to_degrees(place.lat_rad);
    planes.height_m[at] = static_cast<float>(place.height_m);
    planes.range_m[at] = static_cast<float>(to_camera.norm());
    planes.incidence_deg[at] =
        static_cast<float>(to_degrees(std::atan2(to_camera.cross(normal).norm(), to_camera.dot(normal))));
  }
}

}  // namespace

TruthPlanes::TruthPlanes(int width_px, int height_px) : width(width_px), height(height_px) {
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  for (auto* plane : {&longitude_deg, &latitude_deg}) plane->assign(pixels, nan);
  for (auto* plane : {&height_m, &range_m, &incidence_deg, &ground_sample_distance_m})
    plane->assign(pixels, static_cast<float>(nan));
}

bool TruthPlanes::operator==(const TruthPlanes& other) const {
  const auto same = [](const auto& a, const auto& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof a.front()) == 0;
  };
  return width == other.width && height == other.height && same(longitude_deg, other.longitude_deg) &&
         same(latitude_deg, other.latitude_deg) && same(height_m, other.height_m) && same(range_m, other.range_m) &&
         same(incidence_deg, other.incidence_deg) && same(ground_sample_distance_m, other.ground_sample_distance_m);
}

TruthPlanes truth_planes(const ExactChain& chain, int threads) {
  TruthPlanes planes(chain.camera().width_px(), chain.camera().height_px());
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  arena.execute([&] { tbb::parallel_for(0, planes.height, [&](int y) { fill_row(chain, y, planes); }); });
  return planes;
}

}  // namespace nadir::render
