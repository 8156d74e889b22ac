#include "nadir/render/footprint.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "nadir/render/geographic_polygon.h"
#include "ogr_area.h"

namespace nadir::render {
namespace {

using geodesy::Geodetic, geodesy::YawPitchRoll, geodesy::to_radians;
constexpr double pi = std::numbers::pi;

const geodesy::Projection& lon_lat() {
  static const auto projection = geodesy::Projection::from_definition("EPSG:4326").value();
  return projection;
}

Camera camera(int width, int height, double focal_px) {
  return Camera::pinhole(width, height, focal_px, focal_px, width / 2.0, height / 2.0).value();
}
Camera fisheye(int width, int height, double focal_px, std::vector<double> k = {0, 0, 0, 0}) {
  return camera(width, height, focal_px).with_lens(Lens::make(LensModel::equidistant, k).value());
}
Camera barrel(int width, int height, double focal_px) {
  const std::vector<double> k = {-0.25, 0.07, 0.001, -0.0005, 0};
  return camera(width, height, focal_px).with_lens(Lens::make(LensModel::plumb_bob, k).value());
}

Geodetic above(double lat_deg, double lon_deg, double height_m) {
  return Geodetic::degrees(lat_deg, lon_deg, height_m);
}
ExactChain over_plane(const Camera& camera, const Geodetic& place, const YawPitchRoll& attitude) {
  Geodetic origin = place;
  origin.height_m = 0;
  return ExactChain(camera, camera_pose(place, attitude), Plane(origin, 0));
}
ExactChain over_ellipsoid(const Camera& camera, const Geodetic& place, const YawPitchRoll& attitude) {
  Geodetic origin = place;
  origin.height_m = 0;
  return ExactChain(camera, camera_pose(place, attitude), Ellipsoid(origin, 0));
}
const YawPitchRoll level = {};

Footprint footprint_of(double height_m, const YawPitchRoll& attitude) {
  return footprint(over_plane(camera(640, 480, 500), above(38.1, -0.76, height_m), attitude), lon_lat());
}

Eigen::Vector3d on_sphere(const Eigen::Vector2d& p) {
  return {std::cos(p.y()) * std::cos(p.x()), std::cos(p.y()) * std::sin(p.x()), std::sin(p.y())};
}

/// Outlines as a reader draws them, lines in longitude and latitude, in points at most `step` apart.
std::vector<Eigen::Vector3d> drawn(const Footprint& f, double step) {
  std::vector<Outline> outlines = {f.outline_lon_lat_rad};
  outlines.insert(outlines.end(), f.more_outlines_lon_lat_rad.begin(), f.more_outlines_lon_lat_rad.end());
  std::vector<Eigen::Vector3d> points;
  for (const Outline& outline : outlines)
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const Eigen::Vector2d &a = outline[i], &b = outline[(i + 1) % outline.size()];
      const Eigen::Vector2d line(std::remainder(b.x() - a.x(), 2 * pi), b.y() - a.y());
      const double parallel = line.x() * std::cos(std::min(std::abs(a.y()), std::abs(b.y())));
      const int parts = 1 + static_cast<int>(std::hypot(parallel, line.y()) / step);
      for (int k = 0; k < parts; ++k) points.push_back(on_sphere(a + line * k / parts));
    }
  return points;
}

double distance(const Eigen::Vector3d& p, const std::vector<Eigen::Vector3d>& points) {
  double least = 10;
  for (const auto& q : points) least = std::min(least, (p - q).squaredNorm());
  return std::sqrt(least);
}

/// The greatest between two of some of them.
double extent(const std::vector<Eigen::Vector3d>& points) {
  double greatest = 0;
  const std::size_t stride = points.size() / 200 + 1;
  for (std::size_t i = 0; i < points.size(); i += stride)
    for (std::size_t k = 0; k < i; k += stride) greatest = std::max(greatest, (points[i] - points[k]).norm());
  return greatest;
}

/// Whether a place is seen: by the forward projection, which shares nothing with how outlines are found.
bool sees(const ExactChain& chain, double lon_rad, double lat_rad) {
  const auto& camera = chain.camera();
  Eigen::Vector3d ray;
  if (const Plane* plane = chain.surface().plane()) {
    const auto place = plane->at(lon_rad, lat_rad);
    if (!place || !(chain.height_above_ground_m() > 0)) return false;
    const auto& pose = chain.enu_from_camera();
    ray = pose.rotation.conjugate() * (place->xyz - pose.origin);
    const double far_m = std::max(1e6, 4 * chain.height_above_ground_m());
    if (!((chain.flat() ? ray.z() : ray.norm()) < far_m)) return false;
  } else {
    const auto place = geodesy::ecef_from_geodetic({lat_rad, lon_rad, chain.surface().height_m()}).xyz;
    const auto& pose = chain.ecef_from_camera();
    ray = pose.rotation.conjugate() * (place - pose.origin);
    if (!(on_sphere({lon_rad, lat_rad}).dot(place - pose.origin) < 0)) return false;  // it lies beyond the horizon
  }
  const auto image = camera.image_of(ray);
  return image && (image->array() >= 0).all() && image->x() <= camera.width_px() && image->y() <= camera.height_px();
}

/// Asks of many places, around and next to the outline, whether the polygons hold what is seen and nothing else, but
/// for what lies within the tolerance of the outline.
void expect_that_polygons_hold_what_is_seen(const char* name, const ExactChain& chain, int places) {
  const Footprint f = footprint(chain, lon_lat());
  const auto polygons = geographic_polygons(f);
  ASSERT_EQ(test::complaint(polygons), "") << name;
  ASSERT_FALSE(polygons.empty()) << name;
  const OGRMultiPolygon area = test::ogr_area(polygons);
  const double rough = extent(drawn(f, 0.01));
  const auto lines = drawn(f, 1e-4 * rough);
  const double size = extent(lines);
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const auto& p : lines) middle += p;
  middle /= static_cast<double>(lines.size());

  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  std::uniform_int_distribution<std::size_t> any(0, lines.size() - 1);
  int seen = 0, unseen = 0, disputed = 0;
  double worst = 0;
  std::string where;
  for (int i = 0; i < places; ++i) {
    const Eigen::Vector3d aside(normal(random), normal(random), normal(random));
    const bool at_edge = i % 2 == 0;
    const Eigen::Vector3d p =
        ((at_edge ? lines[any(random)] : middle) + aside * size * (at_edge ? 2e-3 : 0.3)).normalized();
    const double lon = std::atan2(p.y(), p.x()), lat = std::asin(p.z());
    const bool expected = sees(chain, lon, lat);
    (expected ? seen : unseen)++;
    const OGRPoint point(geodesy::to_degrees(lon), geodesy::to_degrees(lat));
    if (area.Intersects(&point) == expected) continue;
    ++disputed;
    if (const double off = distance(p, lines); off > worst) {
      worst = off;
      where = "longitude " + std::to_string(point.getX()) + ", latitude " + std::to_string(point.getY()) +
              (expected ? " is seen" : " is not seen");
    }
  }
  EXPECT_LE(worst, (outline_tolerance + 1e-4) * size) << name << ": " << where;
  EXPECT_GT(seen, places / 20) << name;
  EXPECT_GT(unseen, places / 20) << name;
  EXPECT_LT(disputed, places / 10) << name;
}

TEST(Footprint, ALevelViewCoversWhatSimilarTrianglesSay) {
  const Footprint f = footprint_of(1000, {});
  // Half the image over the focal length, times the height: 640 m east, 480 m north.
  ASSERT_TRUE(f.corners[0] && f.corners[2]);
  EXPECT_NEAR((f.corners[0]->enu_m - Eigen::Vector3d(-640, 480, 0)).norm(), 0, 1e-6) << "top left is north-west";
  EXPECT_NEAR((f.corners[2]->enu_m - Eigen::Vector3d(640, -480, 0)).norm(), 0, 1e-6);
  EXPECT_LT(f.corners[0]->lon_lat_rad.x(), f.corners[1]->lon_lat_rad.x());
  EXPECT_GT(f.corners[0]->lon_lat_rad.y(), f.corners[3]->lon_lat_rad.y());
  ASSERT_EQ(f.outline_lon_lat_rad.size(), 4u) << "its edges are as straight as parallels and meridians";
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(f.outline_lon_lat_rad[i], f.corners[i]->lon_lat_rad);
}

TEST(Footprint, ACornerInTheSkyHasNoPointAndTheOutlineEndsAtTheHorizon) {
  const Footprint f =
      footprint_of(1000, YawPitchRoll::degrees(0, 75, 0));  // the top of the image sees 100 degrees from down
  EXPECT_FALSE(f.corners[0]);
  EXPECT_FALSE(f.corners[1]);
  EXPECT_TRUE(f.corners[2]);
  EXPECT_FALSE(f.outline_lon_lat_rad.empty());
  for (const auto& p : f.outline_lon_lat_rad) EXPECT_TRUE(p.allFinite());
}

TEST(Footprint, TheSkyAloneHasNone) {
  for (const Footprint& f :
       {footprint_of(1000, YawPitchRoll::degrees(0, 180, 0)), footprint_of(-10, {}),
        footprint(over_ellipsoid(barrel(640, 480, 500), above(10, 20, 1000), YawPitchRoll::degrees(0, 170, 0)),
                  lon_lat())}) {
    EXPECT_TRUE(f.outline_lon_lat_rad.empty());
    EXPECT_TRUE(f.more_outlines_lon_lat_rad.empty());
    for (const auto& corner : f.corners) EXPECT_FALSE(corner);
  }
}

TEST(Footprint, PolygonsHoldWhatIsSeenWhereverTheCameraIs) {
  const Camera ideal = camera(640, 480, 500), lens = barrel(640, 480, 400);
  const auto turned = [](double yaw, double pitch, double roll) { return YawPitchRoll::degrees(yaw, pitch, roll); };
  const auto check = expect_that_polygons_hold_what_is_seen;
  constexpr int places = 4000;
  check("plane", over_plane(ideal, above(38.1, -0.76, 3000), turned(30, 5, -3)), places);
  check("plane, far north", over_plane(ideal, above(79, 12, 30e3), turned(77, 20, 5)), places);
  check("plane, lens, equator", over_plane(lens, above(0, 0, 500), turned(10, 0, 0)), places);
  check("plane, across 180", over_plane(ideal, above(60, 179.99, 2000), turned(10, 55, 10)), places);
  check("plane, horizon", over_plane(ideal, above(20, 30, 2000), turned(10, 70, 10)), places);
  check("plane, lens, horizon", over_plane(lens, above(20, 30, 2000), turned(10, 70, 10)), places);
  check("one metre up", over_plane(ideal, above(48, 11, 1), turned(30, 5, -3)), places);
  check("ellipsoid, equator", over_ellipsoid(ideal, above(0, 10, 5000), turned(200, 0, 0)), places);
  check("ellipsoid, across 180", over_ellipsoid(ideal, above(51, -179, 400e3), turned(20, 10, 0)), places);
  check("ellipsoid, lens", over_ellipsoid(lens, above(45, 7, 800e3), level), places);
  check("ellipsoid, horizon", over_ellipsoid(ideal, above(45, 7, 10e3), turned(0, 80, 5)), places);
  check("ellipsoid, lens, horizon", over_ellipsoid(lens, above(70, 170, 10e3), turned(45, 80, 25)), places);
  check("horizon just within an edge", over_ellipsoid(ideal, above(10, 20, 10e3), turned(0, 92.1, 0)), places);
}

TEST(Footprint, PolygonsHoldWhatIsSeenAroundPoles) {
  const Camera ideal = camera(640, 480, 500), lens = barrel(640, 480, 400);
  const auto check = expect_that_polygons_hold_what_is_seen;
  constexpr int places = 4000;
  check("north pole within", over_ellipsoid(ideal, above(89.9, 30, 100e3), level), places);
  check("south pole within, lens", over_plane(lens, above(-89.99, 30, 9e3), level), places);
  // The edge of 480 m is 0.00430 degrees from below the camera.
  for (const double off_deg : {0.0040, 0.0042, 0.0043, 0.0044, 0.0046})
    check("a pole at the edge", over_plane(ideal, above(90 - off_deg, 0, 1000), YawPitchRoll::degrees(180, 0, 0)),
          places);
  check("horizon beyond a pole", over_ellipsoid(ideal, above(89, 30, 10e3), YawPitchRoll::degrees(10, 80, 0)), places);
}

TEST(Footprint, TheEarthFromOrbitIsADisc) {
  const Camera wide = camera(1000, 1000, 300);
  const auto check = expect_that_polygons_hold_what_is_seen;
  for (const double lat_deg : {0.0, 50.0, 89.0, -85.0})
    for (const double lon_deg : {10.0, 175.0})
      check("all of the Earth", over_ellipsoid(wide, above(lat_deg, lon_deg, 36e6), level), 2000);
  check("low", over_ellipsoid(fisheye(1000, 1000, 300), above(30, 100, 800e3), level), 2000);
  check("less than a pixel", over_ellipsoid(camera(100, 100, 10), above(30, 100, 1e9), level), 2000);
  check("cut by one edge", over_ellipsoid(wide, above(30, 100, 36e6), YawPitchRoll::degrees(0, 58, 0)), 2000);

  // A polygon of n corners leaves its circle by 1 - cos(pi / n) of the radius: by 1e-3 of the diameter for n = 50.
  const Footprint f = footprint(over_ellipsoid(wide, above(0, 10, 36e6), level), lon_lat());
  EXPECT_GE(f.outline_lon_lat_rad.size(), 50u);
  EXPECT_LE(f.outline_lon_lat_rad.size(), 100u) << "no more than halving takes";
  for (const auto& corner : f.corners) EXPECT_FALSE(corner);
}

TEST(Footprint, ALensMayCutCornersOffAndSeeSeveralParts) {
  const auto check = expect_that_polygons_hold_what_is_seen;
  const Camera folds =
      camera(1200, 800, 300)
          .with_lens(Lens::make(LensModel::plumb_bob, std::vector<double>{-0.3, 0, 0.002, 0.001, 0}).value());
  check("corners cut off", over_plane(folds, above(10, 20, 1000), level), 4000);
  check("corners cut off, ellipsoid", over_ellipsoid(folds, above(10, 20, 100e3), level), 4000);
  check("corners cut off and horizon", over_plane(folds, above(10, 20, 1000), YawPitchRoll::degrees(20, 70, 30)), 4000);
  check("circular fisheye", over_ellipsoid(fisheye(1200, 1200, 200, {0, -0.2, 0, 0}), above(10, 20, 400e3), level),
        4000);

  // Looking up, past a right angle from its axis: a ring of ground, with a hole below the camera
  const YawPitchRoll up = YawPitchRoll::degrees(20, 172, 0);
  const Camera around = fisheye(880, 880, 200);
  const ExactChain ring = over_ellipsoid(around, above(10, 20, 800e3), up);
  check("ring", ring, 4000);
  EXPECT_EQ(footprint(ring, lon_lat()).more_outlines_lon_lat_rad.size(), 1u);
  EXPECT_EQ(geographic_polygons(footprint(ring, lon_lat())).front().size(), 2u);
  check("ring around a pole", over_ellipsoid(around, above(88, 20, 800e3), up), 4000);
  check("ring across 180", over_ellipsoid(around, above(8, 179, 800e3), up), 4000);
  // It shows the ray behind it in each corner: what each side leaves out is a hole of its own
  const ExactChain holes = over_ellipsoid(fisheye(1000, 1000, 220), above(10, 20, 800e3), up);
  check("four holes", holes, 4000);
  EXPECT_EQ(geographic_polygons(footprint(holes, lon_lat())).front().size(), 5u);
  const ExactChain parts = over_ellipsoid(fisheye(1000, 300, 220), above(10, 20, 800e3), up);
  check("two parts", parts, 4000);
  EXPECT_EQ(geographic_polygons(footprint(parts, lon_lat())).size(), 2u);
}

TEST(Footprint, RandomViewsGiveValidPolygons) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  int areas = 0;
  for (int i = 0; i < 4000; ++i) {
    const double lat_deg = i % 4 == 0 ? 90 - std::pow(10, -6 * unit(random)) : 180 * unit(random) - 90;
    const double lon_deg = i % 3 == 0 ? 180 - std::pow(10, -6 * unit(random)) : 360 * unit(random) - 180;
    const Geodetic place = above(i % 8 == 0 ? -lat_deg : lat_deg, lon_deg, std::pow(10, 9 * unit(random) - 1));
    const YawPitchRoll attitude = YawPitchRoll::degrees(360 * unit(random), 180 * unit(random), 60 * unit(random) - 30);
    const double focal_px = 150 + 800 * unit(random);
    const Camera cameras[] = {camera(640, 480, focal_px), barrel(640, 480, focal_px), fisheye(640, 480, focal_px),
                              fisheye(640, 480, focal_px, {0.1 * unit(random), -0.2 * unit(random), 0, 0})};
    const Camera& used = cameras[(i / 2) % 4];
    const ExactChain chain = i % 2 == 0 ? over_plane(used, place, attitude) : over_ellipsoid(used, place, attitude);
    const Footprint f = footprint(chain, lon_lat());
    const auto polygons = geographic_polygons(f);
    EXPECT_EQ(test::complaint(polygons), "") << i;
    EXPECT_EQ(polygons.empty(), f.outline_lon_lat_rad.empty()) << i;
    EXPECT_LE(f.outline_lon_lat_rad.size(), 400u) << i;
    areas += polygons.empty() ? 0 : 1;
  }
  EXPECT_GT(areas, 2000);
}

}  // namespace
}  // namespace nadir::render
