#include <fmt/format.h>

#include <GeographicLib/Geodesic.hpp>
#include <cmath>

#include "maps.h"
#include "must.h"
#include "nadir/render/renderer.h"
#include "original.h"
#include "sections.h"

namespace nadir::bench {
namespace {

/// The original's camera by default, at the height of its flight.
constexpr double flight_height_m = 500.5, focal_px = 530;
constexpr int side_px = 512;

render::Camera camera() {
  return must(render::Camera::pinhole(side_px, side_px, focal_px, focal_px, side_px / 2.0, side_px / 2.0));
}

/// Metres on the ellipsoid between two texel positions of a map in EPSG:3857, by that CRS's own formulas.
double geodesic_m(const tile::Map& map, const Eigen::Vector2d& texel_a, const Eigen::Vector2d& texel_b) {
  constexpr double radius_m = 6378137;
  const auto lat_lon_deg = [&](const Eigen::Vector2d& texel) {
    const Eigen::Vector2d m = map.crs_from_texel() * texel;
    return Eigen::Vector2d(geodesy::to_degrees(std::atan(std::sinh(m.y() / radius_m))),
                           geodesy::to_degrees(m.x() / radius_m));
  };
  const Eigen::Vector2d a = lat_lon_deg(texel_a), b = lat_lon_deg(texel_b);
  double distance_m = 0;
  GeographicLib::Geodesic::WGS84().Inverse(a.x(), a.y(), b.x(), b.y(), distance_m);
  return distance_m;
}

/// Metres between the marks in the east and west, and in the north and south, from where a level picture shows them.
/// `at(x, y)`: grey value of a pixel.
template <class At>
Eigen::Vector2d metres_between_marks(const At& at) {
  std::array<Eigen::Vector3d, 4> sums;  // of x, y and weight: east, south, west, north
  sums.fill(Eigen::Vector3d::Zero());
  for (int y = 0; y < side_px; ++y)
    for (int x = 0; x < side_px; ++x) {
      const double dx = x + 0.5 - side_px / 2.0, dy = y + 0.5 - side_px / 2.0, weight = at(x, y);
      sums[std::abs(dx) > std::abs(dy) ? (dx > 0 ? 0 : 2) : (dy > 0 ? 1 : 3)] += weight * Eigen::Vector3d(dx, dy, 1);
    }
  const auto centre = [&](std::size_t i) { return Eigen::Vector2d(sums[i].head<2>() / sums[i].z()); };
  return Eigen::Vector2d((centre(0) - centre(2)).norm(), (centre(1) - centre(3)).norm()) * (flight_height_m / focal_px);
}

std::string row(const std::string& what, const Eigen::Vector2d& true_m, const Eigen::Vector2d& original_m,
                const Eigen::Vector2d& our_m) {
  const auto error = [](double m, double t) { return 100 * (m / t - 1); };
  std::string text;
  for (int axis = 0; axis < 2; ++axis)
    text += fmt::format("| {}, {} | {:.3f} | {:.3f} | {:+.2f} % | {:.3f} | {:+.3f} % |\n", what,
                        axis == 0 ? "east" : "north", true_m[axis], original_m[axis],
                        error(original_m[axis], true_m[axis]), our_m[axis], error(our_m[axis], true_m[axis]));
  return text;
}

/// Bottom edge and left edge of the footprint: what each publishes as metres, over the geodesic between the texels
/// there.
std::string published(const std::string& place, const tile::Map& map, double height_m) {
  const auto scene = render::Scene::plane(map.center(), {}).with_layer("eo", map, {.bands = {1, 2, 3}});
  render::Renderer renderer;
  const EnuFromCamera enu_from_camera = level(0, 0, height_m);
  const auto frame = must(renderer.render(scene, camera(), scene.surface().frame().ecef_from_enu() * enu_from_camera));
  const render::Truth& truth = frame.truth();
  const Original original(cv::Mat(map.height(), map.width(), CV_8UC3), plane_of_map_units(map));
  const auto seen = must([&]() -> Result<OriginalFootprint> {
    if (const auto footprint = original.footprint(camera(), enu_from_camera)) return *footprint;
    return fail(Error::Kind::OutsideMap, map.description().path + ": the view leaves the map");
  }());

  const auto ratio = [&](const Eigen::Vector2d& a_m, const Eigen::Vector2d& b_m, const Eigen::Vector2d& a_texel,
                         const Eigen::Vector2d& b_texel) {
    return (a_m - b_m).norm() / geodesic_m(map, a_texel, b_texel);
  };
  const auto& corners = truth.footprint.corners;
  const auto& texel = truth.footprint_texel;
  const auto percent = [](double r) { return 100 * (r - 1); };
  // The original's corners: 2 bottom left, 3 bottom right, 0 top left. Ours: 3 bottom left, 2 bottom right, 0 top left.
  return fmt::format("| {} | {:+.2f} % | {:+.2f} % | {:+.5f} % | {:+.5f} % |\n", place,
                     percent(ratio(seen.world_m[2], seen.world_m[3], seen.reference_px[2], seen.reference_px[3])),
                     percent(ratio(seen.world_m[2], seen.world_m[0], seen.reference_px[2], seen.reference_px[0])),
                     percent(ratio(corners[3]->enu_m.head<2>(), corners[2]->enu_m.head<2>(), *texel[3], *texel[2])),
                     percent(ratio(corners[3]->enu_m.head<2>(), corners[0]->enu_m.head<2>(), *texel[3], *texel[0])));
}

}  // namespace

std::string scale_section(const std::filesystem::path& work) {
  const tile::Map map = map_with_marks(work);
  const auto scene = render::Scene::plane(map.center(), {}).with_layer("eo", map, {.bands = {1, 2, 3}});
  render::Renderer renderer;
  const EnuFromCamera enu_from_camera = level(0, 0, flight_height_m);
  const auto frame = must(renderer.render(scene, camera(), scene.surface().frame().ecef_from_enu() * enu_from_camera));
  const Original original(read_bgr(map), plane_of_map_units(map));
  const auto seen = original.footprint(camera(), enu_from_camera);
  const cv::Mat picture = original.picture(
      Original::sensor_from_reference(seen->reference_px, Original::its_rectangle(camera())), camera());

  const Eigen::Vector2d middle(map.width() / 2.0, map.height() / 2.0), east(mark_texels, 0), south(0, mark_texels);
  const Eigen::Vector2d true_m(geodesic_m(map, middle - east, middle + east),
                               geodesic_m(map, middle - south, middle + south));
  const auto pixels = frame.pixels<std::uint8_t>();
  std::string text =
      "## Scale\n\nMetres between two marks on the ground, measured in the pictures (pixels x height / focal "
      "length):\n\n"
      "| at 35.309 N | geodesic (m) | original (m) | error | ours (m) | error |\n| --- | --- | --- | --- | --- | --- "
      "|\n";
  text +=
      row("marks", true_m, metres_between_marks([&](int x, int y) { return picture.at<cv::Vec3b>(y, x)[0]; }),
          metres_between_marks([&](int x, int y) { return pixels[static_cast<std::size_t>(3 * (y * side_px + x))]; }));
  text +=
      "\nSides of the footprint as published in metres, over the geodesic between the texels that they join:\n\n"
      "| map | original, east | north | ours, east | north |\n| --- | --- | --- | --- | --- |\n";
  text += published("35.309 N, zoom 17", map, flight_height_m);
  text += published("47.020 N, naip_2014.tif in EPSG:3857", naip_in_mercator(work), flight_height_m);
  text += published("0.351 N, kampala.tif", shipped_map("kampala.tif"), 100);
  return text;
}

}  // namespace nadir::bench
