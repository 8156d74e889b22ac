// Maps that go around the Earth have two ends, and no view shows them: the same world cut elsewhere gives the same
// picture.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "nadir/render/renderer.h"
#include "nadir/render/truth_planes.h"
#include "support/synthetic_map.h"
#include "support/temporary_folder.h"

namespace nadir::render {
namespace {

constexpr int columns = 720;  // not whole cells
constexpr double turn_deg = 360, equator_m = 2 * std::numbers::pi * 6378137;

/// A map of the world whose first column is `first`, counted from the antimeridian. `value`: of a column counted from
/// there, whatever the map's first, and a row; in texels of level 0.
test::SyntheticMap world(const std::string& crs, int first, const std::function<double(double, double)>& value) {
  test::SyntheticMap map;
  map.width = columns;
  const bool square = crs == "EPSG:3857";
  const int rows = map.height = square ? columns : columns / 2;
  const double turn = square ? equator_m : turn_deg, texel = turn / columns;
  map.crs = crs;
  map.geotransform = {-turn / 2 + first * texel, texel, 0, texel * rows / 2, 0, -texel};
  map.value = [first, value](int level, int, int col, int row) {
    const double size = std::pow(2, level);
    const double x = std::fmod(first + (col + 0.5) * size, columns);
    return value(x, (row + 0.5) * size);
  };
  return map;
}

/// Different in every texel, and never smooth.
double noise(double x, double y) {
  const auto mixed = static_cast<std::uint32_t>(x) * 2654435761u ^ static_cast<std::uint32_t>(y) * 40503u * 65537u;
  return static_cast<double>((mixed ^ mixed >> 15) % 251u) + 1;
}

struct View {
  double lat_deg, lon_deg, height_m, yaw_deg, pitch_deg;
};
const std::vector<View> views = {{10, 180, 300e3, 20, 0},  {-60, -179.9, 900e3, 0, 30}, {0, 179, 5000e3, 130, 0},
                                 {89.5, 20, 800e3, 45, 0}, {-90, 0, 2000e3, 0, 0},      {75, 180, 3000e3, 200, 40},
                                 {30, -90, 36000e3, 0, 0}, {45, 180, 36000e3, 10, 0},   {5, 0, 400e3, 77, 10}};

Frame render(const tile::Map& map, const View& view, const RenderOptions& options,
             const RendererOptions& machine = {}) {
  const auto place = geodesy::Geodetic::degrees(view.lat_deg, view.lon_deg, view.height_m);
  const Scene scene =
      Scene::ellipsoid(geodesy::Geodetic::degrees(view.lat_deg, view.lon_deg, 0), 0).with_layer("eo", map);
  return Renderer(machine)
      .render(scene, Camera::pinhole(160, 120, 150, 150, 80, 60).value(),
              camera_pose(place, geodesy::YawPitchRoll::degrees(view.yaw_deg, view.pitch_deg, 0)), options)
      .value();
}

class WorldMap : public testing::TestWithParam<const char*> {
 protected:
  tile::Map open(const test::SyntheticMap& synthetic, const std::string& name) {
    test::write_map(synthetic, folder.file(name));
    return tile::Map::open(folder.file(name)).value();
  }
  const test::TemporaryFolder folder;
};

TEST_P(WorldMap, CutElsewhereGivesTheSamePicture) {
  const tile::Map whole = open(world(GetParam(), 0, noise), "a.tif"),
                  cut = open(world(GetParam(), 250, noise), "b.tif");
  ASSERT_TRUE(whole.goes_around() && cut.goes_around());
  for (const View& view : views) {
    // One level and one sample a pixel, so that pictures differ by geometry alone: 1e-5 pixels, of at most 8 texels
    // each, of at most 250 values from one to the next.
    const RenderOptions options{.filter = Filter::Bilinear, .geometry_tolerance_px = 1e-5};
    const Frame a = render(whole, view, options), b = render(cut, view, options);
    std::int64_t valid = 0;
    double worst = 0;
    for (std::size_t i = 0; i < a.layer().validity.size(); ++i) {
      EXPECT_EQ(a.layer().validity[i], b.layer().validity[i]) << i;
      if (!a.layer().validity[i]) continue;
      ++valid;
      worst = std::max(worst, std::abs(static_cast<double>(a.pixels<float>()[i]) - b.pixels<float>()[i]));
    }
    EXPECT_LE(worst, 0.03) << view.lat_deg << ", " << view.lon_deg << " from " << view.height_m;
    if (std::abs(view.lat_deg) < 80) {
      EXPECT_GT(valid, 160 * 120 / 20) << "beyond 85 degrees Web Mercator has no map";
    }
    if (view.height_m < 4e6 && std::abs(view.lat_deg) < 75) {
      EXPECT_EQ(a.truth().valid_fraction, 1) << view.lat_deg << ": no gap";
    }
  }
}

TEST_P(WorldMap, HasNoSeamAtAnyLevelOrFilter) {
  // Waves around the Earth, the same at each level: what a picture should show is known from each pixel's longitude.
  const auto wave = [](double x) { return 100 + 50 * std::sin(3 * 2 * std::numbers::pi * x / columns); };
  test::SyntheticMap synthetic = world(GetParam(), 0, [&](double x, double) { return wave(x); });
  synthetic.factors = {2, 4, 8};
  const tile::Map map = open(synthetic, "m.tif");
  for (const View& view : {views[0], views[1], views[2], views[7]})
    for (const Filter filter : {Filter::Nearest, Filter::Bilinear, Filter::Mip, Filter::Reference})
      for (const Quality quality : {Quality::balanced, Quality::best}) {
        const Frame frame = render(map, view, {.quality = quality, .filter = filter});
        const auto place = geodesy::Geodetic::degrees(view.lat_deg, view.lon_deg, view.height_m);
        const ExactChain chain(Camera::pinhole(160, 120, 150, 150, 80, 60).value(),
                               camera_pose(place, geodesy::YawPitchRoll::degrees(view.yaw_deg, view.pitch_deg, 0)),
                               Ellipsoid(geodesy::Geodetic::degrees(view.lat_deg, view.lon_deg, 0), 0));
        const TruthPlanes truth = truth_planes(chain, 0);
        double worst = 0;
        for (std::size_t i = 0; i < frame.layer().validity.size(); ++i)
          if (frame.layer().validity[i] && std::abs(truth.latitude_deg[i]) < 60 && truth.incidence_deg[i] < 45)
            worst = std::max(
                worst, std::abs(frame.pixels<float>()[i] - wave((truth.longitude_deg[i] + 180) / turn_deg * columns)));
        // A texel of level 3 spans 12 degrees of the wave's phase: half of it is off by 5.3 for nearest; linear
        // interpolation and averages over it are off by 50 (1 - cos 6 degrees) = 0.3, or twice that for both, and a
        // pixel's mean over up to 19 degrees, from 36000 km, by 50 * 0.33^2 / 24 = 0.2 more.
        EXPECT_LE(worst, filter == Filter::Nearest ? 6 : 0.9) << to_string(filter) << " from " << view.height_m;
      }
}

TEST_P(WorldMap, AroundItsEndsDependsOnNeitherThreadsNorBudget) {
  test::SyntheticMap synthetic = world(GetParam(), 0, noise);
  synthetic.factors = {2, 4, 8};
  synthetic.nodata = 7;
  const tile::Map map = open(synthetic, "m.tif");
  for (const View& view : {views[0], views[5]}) {
    const Frame one = render(map, view, {}, {.cache_bytes = 64 << 20, .threads = 1});
    const Frame two = render(map, view, {}, {.cache_bytes = 3 << 20, .threads = 2});
    EXPECT_GT(two.counters().passes, 0);
    EXPECT_EQ(one.layer().validity, two.layer().validity);
    EXPECT_EQ(one.layer().samples, two.layer().samples);
  }
}

INSTANTIATE_TEST_SUITE_P(Crs, WorldMap, testing::Values("EPSG:4326", "EPSG:3857"),
                         [](const auto& tested) { return std::string(tested.param).substr(5); });

TEST_F(WorldMap, ATurnWithOneColumnTwiceHasNoGapEither) {
  // Points at every half degree from 0 to 360, both there
  test::SyntheticMap synthetic = world("EPSG:4326", 0, noise);
  synthetic.width = columns + 1;
  synthetic.geotransform[0] = -0.25;
  const auto value = [](int col) { return noise((col + columns / 2) % columns, 1); };
  synthetic.value = [&](int, int, int col, int) { return value(col % columns); };
  const tile::Map map = open(synthetic, "m.tif");
  EXPECT_FALSE(map.goes_around());
  const Frame frame = render(map, {10, 0, 300e3, 20, 0}, {.filter = Filter::Bilinear});
  EXPECT_EQ(frame.truth().valid_fraction, 1);
}

TEST_F(WorldMap, AwayFromItsEndsOrWithoutThemIsPlannedAsAnyOther) {
  const tile::Map whole = open(world("EPSG:4326", 0, noise), "a.tif");
  test::SyntheticMap part = world("EPSG:4326", 0, noise);
  part.width = columns - 1;
  const tile::Map without = open(part, "b.tif");
  ASSERT_FALSE(without.goes_around());
  const Frame a = render(whole, {5, 0, 400e3, 77, 10}, {}), b = render(without, {5, 0, 400e3, 77, 10}, {});
  EXPECT_EQ(a.counters().cells, b.counters().cells);
  EXPECT_EQ(a.counters().exact_points, b.counters().exact_points);
  // Its texels are half a texel nearer to the middle of the turn that longitudes are counted on, no more
  EXPECT_EQ(a.layer().samples, b.layer().samples);
}

TEST_F(WorldMap, HomographiesGoOnAcrossItsEnds) {
  const tile::Map map = open(world("EPSG:4326", 0, noise), "m.tif");
  const auto origin = geodesy::Geodetic::degrees(10, 180, 0);
  const Scene scene = Scene::plane(origin, {}).with_layer("eo", map);
  const Frame frame = Renderer()
                          .render(scene, Camera::pinhole(160, 120, 150, 150, 80, 60).value(),
                                  look_down(geodesy::Geodetic::degrees(10, 180, 2000), geodesy::Degrees{30}))
                          .value();
  const Truth& truth = frame.truth();
  EXPECT_EQ(truth.valid_fraction, 1);
  ASSERT_TRUE(truth.homography_max_error_px);
  EXPECT_LT(*truth.homography_max_error_px, 0.05);
  for (const auto& uv : truth.footprint_uv) EXPECT_TRUE(uv && (uv->array() >= 0).all() && (uv->array() <= 1).all());
  const auto rejected = Renderer().render(scene, Camera::pinhole(160, 120, 150, 150, 80, 60).value(),
                                          look_down(geodesy::Geodetic::degrees(10, 180, 2000), geodesy::Degrees{30}),
                                          {.off_map = OffMap::Reject});
  EXPECT_TRUE(rejected) << "all of it is on the map";
}

TEST_F(WorldMap, APartInWebMercatorAcrossTheAntimeridianIsSeenFromBothSides) {
  test::SyntheticMap synthetic = world("EPSG:3857", 0, noise);
  synthetic.geotransform = {equator_m / 2 - 360 * 1000, 1000, 0, 180e3, 0, -1000};
  const tile::Map map = open(synthetic, "m.tif");
  for (const double lon_deg : {179.0, -179.0, 180.0}) {
    const Frame frame = render(map, {0, lon_deg, 100e3, 0, 0}, {});
    EXPECT_EQ(frame.truth().valid_fraction, 1) << lon_deg;
  }
}

}  // namespace
}  // namespace nadir::render
