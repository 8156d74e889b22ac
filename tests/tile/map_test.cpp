#include "nadir/tile/map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/synthetic_map.h"
#include "support/temporary_folder.h"

namespace nadir::tile {
namespace {

using test::SyntheticMap, test::TemporaryFolder;

SyntheticMap small_map() {
  SyntheticMap map;
  map.width = 300;
  map.height = 200;
  map.geotransform = {10, 0.001, 0, 50, 0, -0.001};
  map.value = [](int, int band, int col, int row) { return 1000.0 * band + col + 0.001 * row; };
  return map;
}

TEST(Map, ReadsTheBandsAskedForAndNoOthers) {
  const TemporaryFolder folder;
  SyntheticMap synthetic = small_map();
  synthetic.bands = 5;
  test::write_map(synthetic, folder.file("m.tif"));
  const Map map = Map::open(folder.file("m.tif")).value();
  const int bands[] = {4, 2};
  const Texels texels = map.read(0, {7, 9, 3, 2}, bands).value();
  ASSERT_EQ(texels.samples.size(), 3 * 2 * 2 * sizeof(float));
  const auto* samples = reinterpret_cast<const float*>(texels.samples.data());
  EXPECT_FLOAT_EQ(samples[0], 3007.009f) << "band 4 first";
  EXPECT_FLOAT_EQ(samples[1], 1007.009f);
  EXPECT_FLOAT_EQ(samples[2 * (3 + 2)], 3009.010f) << "rows from the top";
  EXPECT_EQ(map.counters().samples_read, 12);
}

TEST(Map, KeepsSampleTypesAndWidensWhatItMust) {
  const TemporaryFolder folder;
  for (const auto& [stored, read] : {std::pair(GDT_Byte, SampleType::UInt8),
                                     {GDT_Int16, SampleType::Int16},
                                     {GDT_UInt16, SampleType::UInt16},
                                     {GDT_Float32, SampleType::Float32},
                                     {GDT_Float64, SampleType::Float32},
                                     {GDT_Int32, SampleType::Float32}}) {
    SyntheticMap synthetic = small_map();
    synthetic.type = stored;
    synthetic.value = [](int, int, int col, int) { return col % 100 + 1; };
    test::write_map(synthetic, folder.file("m.tif"));
    const Map map = Map::open(folder.file("m.tif")).value();
    const int bands[] = {1};
    const Texels texels = map.read(0, {41, 0, 1, 1}, bands).value();
    EXPECT_EQ(texels.type, read) << GDALGetDataTypeName(stored);
    with_sample_type(texels.type, [&]<class T>(T) {
      EXPECT_EQ(static_cast<double>(*reinterpret_cast<const T*>(texels.samples.data())), 42);
    });
  }
}

TEST(Map, ComplexSamplesAreRefusedWithAdvice) {
  const TemporaryFolder folder;
  SyntheticMap synthetic = small_map();
  synthetic.type = GDT_CFloat32;
  test::write_map(synthetic, folder.file("m.tif"));
  const int bands[] = {1};
  const auto read = Map::open(folder.file("m.tif")).value().read(0, {0, 0, 1, 1}, bands);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().kind, Error::Kind::Unsupported);
  EXPECT_NE(read.error().message.find("CFloat32"), std::string::npos);
}

TEST(Validity, ATexelIsInvalidWhereAllBandsReadAreNodata) {
  const TemporaryFolder folder;
  SyntheticMap synthetic = small_map();
  synthetic.type = GDT_Byte;
  synthetic.bands = 2;
  synthetic.nodata = 0;
  // Column 0: both bands nodata; column 1: only the first; else none.
  synthetic.value = [](int, int band, int col, int) { return col == 0 || (col == 1 && band == 0) ? 0 : 9; };
  test::write_map(synthetic, folder.file("m.tif"));
  const Map map = Map::open(folder.file("m.tif")).value();
  const int both[] = {1, 2}, first[] = {1};
  EXPECT_EQ(map.read(0, {0, 0, 3, 1}, both).value().validity, (std::vector<std::uint8_t>{0, 1, 1}));
  EXPECT_EQ(map.read(0, {0, 0, 3, 1}, first).value().validity, (std::vector<std::uint8_t>{0, 0, 1}));
  EXPECT_TRUE(map.read(0, {2, 0, 3, 1}, both).value().validity.empty()) << "all valid: nothing to carry";
}

TEST(Validity, WhatIsNotFiniteIsInvalidAndReadAsZero) {
  const TemporaryFolder folder;
  SyntheticMap synthetic = small_map();
  synthetic.value = [](int, int, int col, int) {
    return col == 0   ? std::numeric_limits<double>::quiet_NaN()
           : col == 1 ? std::numeric_limits<double>::infinity()
                      : 5.0;
  };
  test::write_map(synthetic, folder.file("m.tif"));
  const int bands[] = {1};
  const Texels texels = Map::open(folder.file("m.tif")).value().read(0, {0, 0, 3, 1}, bands).value();
  EXPECT_EQ(texels.validity, (std::vector<std::uint8_t>{0, 0, 1}));
  const auto* samples = reinterpret_cast<const float*>(texels.samples.data());
  EXPECT_EQ(samples[0], 0);
  EXPECT_EQ(samples[1], 0);
}

TEST(Validity, MasksAndAlphaCountFromHalf) {
  const TemporaryFolder folder;
  SyntheticMap masked = small_map();
  masked.mask = true;
  masked.mask_value = [](int col, int) { return col == 0 ? 0 : 255; };
  test::write_map(masked, folder.file("mask.tif"));
  SyntheticMap alpha = small_map();
  alpha.type = GDT_Byte;
  alpha.bands = 2;
  alpha.alpha = true;
  alpha.value = [](int, int band, int col, int) { return band == 0 ? 77 : col == 0 ? 127 : 128; };
  test::write_map(alpha, folder.file("alpha.tif"));
  for (const char* name : {"mask.tif", "alpha.tif"}) {
    const Map map = Map::open(folder.file(name)).value();
    EXPECT_EQ(map.description().data_bands(), std::vector<int>{1}) << name;
    EXPECT_EQ(map.read(0, {0, 0, 2, 1}, map.description().data_bands()).value().validity,
              (std::vector<std::uint8_t>{0, 1}))
        << name;
  }
}

TEST(Levels, ComeFromTheFileWhateverTheirFactors) {
  const TemporaryFolder folder;
  SyntheticMap synthetic = small_map();
  synthetic.factors = {3, 6};
  synthetic.value = [](int level, int, int, int) { return level; };
  test::write_map(synthetic, folder.file("m.tif"));
  const Map map = Map::open(folder.file("m.tif")).value();
  ASSERT_EQ(map.levels().size(), 3u);
  EXPECT_EQ(map.levels()[1].width, 100);
  EXPECT_DOUBLE_EQ(map.levels()[2].texels_x, 300.0 / 50);
  EXPECT_DOUBLE_EQ(map.levels()[2].texels_y, 200.0 / 34) << "sizes are rounded, so axes differ";
  const int bands[] = {1};
  for (int level = 0; level < 3; ++level)
    EXPECT_EQ(*reinterpret_cast<const float*>(map.read(level, {0, 0, 1, 1}, bands).value().samples.data()),
              static_cast<float>(level));
}

TEST(Scale, AMercatorMetreIsNoMetreAndADegreeIsNotSquare) {
  const TemporaryFolder folder;
  SyntheticMap mercator = small_map();
  mercator.crs = "EPSG:3857";
  mercator.geotransform = {0, 10, 0, 8399737.89 + 1000, 0, -10};  // around 60 degrees north
  test::write_map(mercator, folder.file("mercator.tif"));
  const Eigen::Vector2d size = Map::open(folder.file("mercator.tif")).value().texel_size_m();
  // A Mercator metre is N cos(lat) / a = 0.5013 m east and M cos(lat) / a = 0.5004 m north at 60 N, where the
  // ellipsoid's radii of curvature are N = 6394209 m and M = 6383454 m.
  EXPECT_NEAR(size.x(), 5.013, 0.002);
  EXPECT_NEAR(size.y(), 5.004, 0.002);

  SyntheticMap degrees = small_map();
  degrees.geotransform = {-0.78, 8.983e-5, 0, 38.13, 0, -8.983e-5};
  test::write_map(degrees, folder.file("degrees.tif"));
  const Eigen::Vector2d ten = Map::open(folder.file("degrees.tif")).value().texel_size_m();
  EXPECT_NEAR(ten.x(), 7.874, 0.005) << "the 10 m of EPSG:4326 are not 10 m east-west";
  EXPECT_NEAR(ten.y(), 9.971, 0.005);
}

TEST(Open, SaysWhyAMapCannotBePlaced) {
  const TemporaryFolder folder;
  EXPECT_EQ(Map::open(folder.file("none.tif")).error().kind, Error::Kind::NotFound);
  EXPECT_EQ(Map::open(folder.write("text.tif", "no raster")).error().kind, Error::Kind::Malformed);

  SyntheticMap nowhere = small_map();
  nowhere.crs = "";
  test::write_map(nowhere, folder.file("nowhere.tif"));
  const auto unplaced = Map::open(folder.file("nowhere.tif"));
  ASSERT_FALSE(unplaced);
  EXPECT_NE(unplaced.error().message.find("gdal_edit.py -a_srs"), std::string::npos) << unplaced.error().message;
  EXPECT_TRUE(describe(folder.file("nowhere.tif"))) << "it can still be described";

  SyntheticMap wrong = small_map();  // metres where degrees are meant
  wrong.geotransform = {500000, 10, 0, 4000000, 0, -10};
  test::write_map(wrong, folder.file("wrong.tif"));
  EXPECT_FALSE(Map::open(folder.file("wrong.tif")));
}

/// Points every 60 texels, on a turned and sheared grid, the one in the middle `off` texels beside it.
SyntheticMap map_of_control_points(double off) {
  SyntheticMap map = small_map();
  map.crs = "EPSG:32614";
  for (double y = 0; y <= 180; y += 60)
    for (double x = 0; x <= 300; x += 60) {
      const double beside = x == 120 && y == 60 ? off : 0;
      map.control_points.push_back({x, y, 600000 + 30 * (x + beside) + 4 * y, 5.2e6 + 7 * (x + beside) - 28 * y});
    }
  return map;
}

TEST(ControlPoints, OnAGridAreTheGeotransform) {
  const TemporaryFolder folder;
  const SyntheticMap synthetic = map_of_control_points(0);
  test::write_map(synthetic, folder.file("m.tif"));
  const auto map = Map::open(folder.file("m.tif"));
  ASSERT_TRUE(map) << map.error().message;
  EXPECT_EQ(map->description().georeference->crs, "EPSG:32614");
  for (const auto& [x, y, place_x, place_y] : synthetic.control_points)
    EXPECT_LT((map->crs_from_texel() * Eigen::Vector2d(x, y) - Eigen::Vector2d(place_x, place_y)).norm(), 1e-6);
}

TEST(ControlPoints, ServeToATenthOfATexelAndNoFurther) {
  const TemporaryFolder folder;
  test::write_map(map_of_control_points(0.1), folder.file("near.tif"));
  EXPECT_TRUE(Map::open(folder.file("near.tif"))) << "least squares spread what one is off";
  test::write_map(map_of_control_points(0.12), folder.file("off.tif"));
  SyntheticMap few = map_of_control_points(0), line = few;
  few.control_points = {line.control_points[0], line.control_points[5], line.control_points[20]};
  test::write_map(few, folder.file("three.tif"));
  line.control_points.resize(6);
  test::write_map(line, folder.file("line.tif"));
  for (const char* name : {"off.tif", "three.tif", "line.tif"}) {
    const auto map = Map::open(folder.file(name));
    ASSERT_FALSE(map) << name;
    EXPECT_NE(map.error().message.find("gdalwarp"), std::string::npos) << map.error().message;
    EXPECT_NE(describe(folder.file(name)).value().georeference_problem.find("control points"), std::string::npos);
  }
}

TEST(GoesAround, IsToldFromTheTurnOfItsCrs) {
  const TemporaryFolder folder;
  const double equator = 2 * 3.14159265358979323846 * 6378137;
  struct Case {
    const char* crs;
    double left, texel;
    int width;
    bool around;
  };
  for (const Case& c : {Case{"EPSG:4326", -180, 1, 360, true}, Case{"EPSG:4326", 0, 1, 360, true},
                        Case{"EPSG:4326", 180, -1, 360, true}, Case{"EPSG:4326", -0.5, 1, 361, false},
                        Case{"EPSG:4326", -180, 1, 359, false}, Case{"EPSG:4258", -180, 1, 360, true},
                        Case{"EPSG:3857", -equator / 2, equator / 512, 512, true},
                        Case{"EPSG:3857", 0, 1000, 512, false}, Case{"EPSG:32614", 0, 10, 360, false}}) {
    SyntheticMap synthetic = small_map();
    synthetic.crs = c.crs;
    synthetic.width = c.width;
    synthetic.geotransform = {c.left, c.texel, 0, 50, 0, -std::abs(c.texel)};
    test::write_map(synthetic, folder.file("m.tif"));
    EXPECT_EQ(Map::open(folder.file("m.tif")).value().goes_around(), c.around) << c.crs << " " << c.left;
  }
}

TEST(Open, FarOutsideItsUtmZoneAMapHasNoPlace) {
  const TemporaryFolder folder;
  SyntheticMap synthetic = small_map();
  synthetic.crs = "EPSG:32614";
  synthetic.geotransform = {7.5e6, 30, 0, 5e6, 0, -30};
  test::write_map(synthetic, folder.file("m.tif"));
  const auto map = Map::open(folder.file("m.tif"));
  ASSERT_FALSE(map);
  for (const char* words : {"EPSG:32614", "not defined", "gdalwarp"})
    EXPECT_NE(map.error().message.find(words), std::string::npos) << map.error().message;
}

TEST(Describe, BandsAreFoundByNumberAndName) {
  const TemporaryFolder folder;
  SyntheticMap synthetic = small_map();
  synthetic.bands = 2;
  test::write_map(synthetic, folder.file("m.tif"));
  MapDescription map = describe(folder.file("m.tif")).value();
  map.bands[0].name = "VV";
  map.bands[1].name = "VH";
  EXPECT_EQ(map.find_band("VH").value(), 2);
  EXPECT_EQ(map.find_band("1").value(), 1);
  for (const char* bad : {"0", "3", "1.5", "HV", ""}) EXPECT_FALSE(map.find_band(bad)) << bad;
}

}  // namespace
}  // namespace nadir::tile
