#include "nadir/sim/map_wind.h"

#include <gtest/gtest.h>

#include "nadir/geodesy/geodetic.h"
#include "support/synthetic_map.h"
#include "support/temporary_folder.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;

/// 200 x 150 texels of 0.01 degrees from 10 E, 50 N. Bands are linear in texel coordinates, which bilinear
/// interpolation gives back everywhere: 0.1 x - 3 towards east, 0.2 y + 1 towards north.
class WindMap : public testing::Test {
 protected:
  WindMap() {
    map.width = 200;
    map.height = 150;
    map.bands = 2;
    map.geotransform = {10, 0.01, 0, 50, 0, -0.01};
    map.role = "field";
    map.value = [](int, int band, int col, int row) {
      return band == 0 ? 0.1 * (col + 0.5) - 3 : 0.2 * (row + 0.5) + 1;
    };
  }
  Result<MapWind> open(MapWind::Outside outside = MapWind::Outside::Edge, const std::vector<std::string>& bands = {}) {
    test::write_map(map, folder.file("wind.tif"));
    auto opened = tile::Map::open(folder.file("wind.tif"));
    if (!opened) return fail(opened);
    return MapWind::create(std::move(*opened), bands, outside);
  }
  static Vector3d at(MapWind& wind, double texel_x, double texel_y) {
    const auto place = geodesy::Geodetic::degrees(50 - 0.01 * texel_y, 10 + 0.01 * texel_x, 800);
    return wind.towards_ned_mps({.position = geodesy::ecef_from_geodetic(place)}).value();
  }
  static void expect_near(const Vector3d& found, double east, double north) {
    // The map holds floats: half a step at 32 is 2e-6.
    EXPECT_NEAR(found.y(), east, 4e-6);
    EXPECT_NEAR(found.x(), north, 4e-6);
    EXPECT_EQ(found.z(), 0);
  }
  test::SyntheticMap map;
  test::TemporaryFolder folder;
};

TEST_F(WindMap, IsInterpolatedBetweenTexelCentresAcrossBlocks) {
  auto wind = open().value();
  for (const double x : {0.5, 17.3, 63.9, 64.0, 64.2, 130.75, 199.5})
    for (const double y : {0.5, 3.1, 63.99, 64.5, 100.0, 149.5}) expect_near(at(wind, x, y), 0.1 * x - 3, 0.2 * y + 1);
}

TEST_F(WindMap, GivesTheSameWhereverTheFlightCameFrom) {
  auto forth = open().value(), back = open().value();
  std::vector<Vector3d> seen;
  for (int i = 0; i < 200; ++i) seen.push_back(at(forth, i + 0.3, 149 - 0.7 * i));
  for (int i = 199; i >= 0; --i) EXPECT_EQ(at(back, i + 0.3, 149 - 0.7 * i), seen[static_cast<std::size_t>(i)]) << i;
}

TEST_F(WindMap, OutsideTheNearestPlaceGoesOnOrItIsCalm) {
  auto edge = open().value();
  expect_near(at(edge, -500, 10.5), 0.1 * 0.5 - 3, 0.2 * 10.5 + 1);
  expect_near(at(edge, 1000, 1000), 0.1 * 199.5 - 3, 0.2 * 149.5 + 1);
  expect_near(at(edge, 50, 0.1), 0.1 * 50 - 3, 0.2 * 0.5 + 1);
  auto calm = open(MapWind::Outside::Calm).value();
  EXPECT_EQ(at(calm, -0.1, 10), Vector3d(0, 0, 0));
  EXPECT_EQ(at(calm, 50, 150.1), Vector3d(0, 0, 0));
  expect_near(at(calm, 50, 0.1), 0.1 * 50 - 3, 0.2 * 0.5 + 1);
}

TEST_F(WindMap, TexelsWithoutDataDoNotCount) {
  map.nodata = -99;
  const auto value = map.value;
  map.value = [value](int level, int band, int col, int row) {
    return col >= 100 || (col == 20 && row == 30) ? -99 : value(level, band, col, row);
  };
  auto wind = open().value();
  // Of four texels around (20, 30) the three others are left, 2 of them in column 19, 2 in row 29.
  expect_near(at(wind, 20, 30), (0.1 * 19.5 - 3 + 0.1 * 19.5 - 3 + 0.1 * 20.5 - 3) / 3,
              (0.2 * 29.5 + 1 + 0.2 * 29.5 + 1 + 0.2 * 30.5 + 1) / 3);
  EXPECT_EQ(at(wind, 150, 50), Vector3d(0, 0, 0)) << "no data at all around: calm";
}

TEST_F(WindMap, BandsAreChosenByNumber) {
  auto swapped = open(MapWind::Outside::Edge, {"2", "1"}).value();
  expect_near(at(swapped, 40, 60), 0.2 * 60 + 1, 0.1 * 40 - 3);
}

TEST_F(WindMap, AroundTheEarthThereIsNoSeam) {
  map.width = 360;
  map.geotransform = {-180, 1, 0, 75, 0, -1};
  map.value = [](int, int band, int col, int) { return band == 0 ? (col == 0 ? 8 : col == 359 ? 4 : 0) : 0; };
  auto wind = open().value();
  const auto east = [&](double lon_deg) {
    const auto place = geodesy::Geodetic::degrees(0, lon_deg, 0);
    return wind.towards_ned_mps({.position = geodesy::ecef_from_geodetic(place)}).value().y();
  };
  EXPECT_NEAR(east(-179.5), 8, 1e-9);
  EXPECT_NEAR(east(179.5), 4, 1e-9);
  EXPECT_NEAR(east(179.75), 5, 1e-9);
  EXPECT_NEAR(east(-179.75), 7, 1e-9);
}

TEST_F(WindMap, RefusesWhatIsNoWind) {
  const auto said = [&] {
    const auto wind = open();
    return wind ? std::string("accepted") : wind.error().message;
  };
  EXPECT_EQ(said(), "accepted");
  map.role = "elevation";
  EXPECT_NE(said().find("expected a map of role field, found role elevation"), std::string::npos) << said();
  map.role = "";
  EXPECT_EQ(said(), "accepted") << "a map that does not say";
  map.bands = 1;
  EXPECT_NE(said().find("expected two bands, wind towards east and towards north, found 1"), std::string::npos);
  EXPECT_FALSE(open(MapWind::Outside::Edge, {"1", "7"}));
}

}  // namespace
}  // namespace nadir::sim
