#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "nadir/tile/raster.h"
#include "support/synthetic_map.h"
#include "support/temporary_folder.h"

// Where tiles are decoded here, texels and validity are those of the same map read by GDAL.
namespace nadir::tile {
namespace {

namespace fs = std::filesystem;

/// Reads all levels of a map, whole, here and by GDAL. Whether it could be compared.
bool same_as_by_gdal(const std::string& path) {
  const auto map = Map::open(path);
  const auto by_gdal = raster_module().value()->open(path);
  EXPECT_EQ(map.has_value(), by_gdal.has_value()) << path;
  if (!map || !by_gdal) return false;
  const MapDescription &ours = map->description(), &theirs = (*by_gdal)->description();
  EXPECT_EQ(ours.format, theirs.format) << path;
  EXPECT_EQ(ours.layout, theirs.layout) << path;
  EXPECT_EQ(ours.compression, theirs.compression) << path;
  EXPECT_EQ(ours.validity, theirs.validity) << path;
  EXPECT_EQ(ours.georeference->crs, theirs.georeference->crs) << path;
  EXPECT_TRUE(ours.georeference->crs_from_texel.isApprox(theirs.georeference->crs_from_texel, 1e-14)) << path;
  for (const auto field :
       {&MapDescription::acquired, &MapDescription::attribution, &MapDescription::licence, &MapDescription::role})
    EXPECT_EQ(ours.*field, theirs.*field) << path;
  EXPECT_EQ(ours.warnings, theirs.warnings) << path;
  EXPECT_EQ(ours.bands.size(), theirs.bands.size()) << path;
  for (std::size_t b = 0; b < std::min(ours.bands.size(), theirs.bands.size()); ++b) {
    const Band &a = ours.bands[b], &g = theirs.bands[b];
    EXPECT_EQ(a.name, g.name) << path;
    EXPECT_EQ(a.stored_type, g.stored_type) << path;
    EXPECT_EQ(a.color, g.color) << path << " band " << b + 1;
    EXPECT_EQ(a.unit, g.unit) << path;
    EXPECT_EQ(a.scale, g.scale) << path;
    EXPECT_EQ(a.offset, g.offset) << path;
    EXPECT_EQ(a.nodata.has_value(), g.nodata.has_value()) << path;
  }
  EXPECT_EQ(ours.levels.size(), theirs.levels.size()) << path;
  const std::vector<int> bands = ours.data_bands();
  const auto type = map->sample_type(bands);
  if (!type || ours.levels.size() != theirs.levels.size()) return false;
  for (int level = 0; level < static_cast<int>(ours.levels.size()); ++level) {
    const Level& size = ours.levels[static_cast<std::size_t>(level)];
    const Window whole{0, 0, std::min(size.width, 700), std::min(size.height, 600)};
    const auto texels = map->read(level, whole, bands);
    const auto expected = (*by_gdal)->read(level, whole, bands, *type);
    EXPECT_EQ(texels.has_value(), expected.has_value()) << path << " level " << level;
    if (!texels || !expected) continue;
    // Here what is invalid reads as zero: compare where it is valid
    const std::size_t texel = bands.size() * size_bytes(*type), area = texels->samples.size() / texel;
    std::size_t different = 0;
    for (std::size_t i = 0; i < area; ++i) {
      const bool valid = texels->validity.empty() || texels->validity[i];
      if (!expected->validity.empty() && !expected->validity[i]) different += valid;  // nodata may take away, not add
      if (valid)
        different += !std::equal(texels->samples.begin() + static_cast<std::ptrdiff_t>(i * texel),
                                 texels->samples.begin() + static_cast<std::ptrdiff_t>((i + 1) * texel),
                                 expected->samples.begin() + static_cast<std::ptrdiff_t>(i * texel));
    }
    EXPECT_EQ(different, 0u) << path << " level " << level << ", of " << area;
  }
  return true;
}

TEST(LikeGdal, TheDemonstrationsMaps) {
  int compared = 0;
  for (const auto& entry : fs::directory_iterator(NADIR_SOURCE_DIR "/sim/demo/maps"))
    if (entry.path().extension() == ".tif") compared += same_as_by_gdal(entry.path().string());
  EXPECT_EQ(compared, 5);
}

TEST(LikeGdal, OtherPeoplesOddFiles) {
  const test::TemporaryFolder folder;
  int compared = 0;
  for (const auto& entry : fs::directory_iterator(NADIR_SOURCE_DIR "/tests/data/awkward")) {
    const std::string name = entry.path().filename().string();
    if (entry.path().extension() != ".tif" || name.starts_with("corrupt")) continue;
    compared += same_as_by_gdal(entry.path().string());
  }
  EXPECT_GT(compared, 10);
}

TEST(LikeGdal, PlacesInEveryCrsThatIsCalculatedHere) {
  const test::TemporaryFolder folder;
  for (const int code : {4326, 3857, 32614, 32733, 3413, 3995, 3031, 3976, 32661, 32761, 5041, 5042})
    for (const bool pixel_is_point : {false, true})
      for (const bool turned : {false, true}) {
        test::SyntheticMap map;
        map.crs = "EPSG:" + std::to_string(code);
        map.pixel_is_point = pixel_is_point;
        const double texel = code == 4326 ? 1e-4 : 30;
        map.geotransform = {code == 4326 ? 10 : 1.9e6, texel, turned ? texel / 3 : 0, code == 4326 ? 50 : 2.1e6,
                            turned ? texel / 2 : 0,    -texel};
        map.value = [](int, int, int col, int row) { return col + 1000 * row; };
        const std::string path = folder.file("m.tif");
        test::write_map(map, path);
        ASSERT_TRUE(same_as_by_gdal(path)) << code;
        const auto opened = Map::open(path).value();
        EXPECT_EQ(opened.description().georeference->definition, map.crs) << "described here, not by GDAL";
        EXPECT_FALSE(opened.projection().uses_library());
        Eigen::Vector2d corner = opened.crs_from_texel() * Eigen::Vector2d(0, 0);
        EXPECT_LT((corner - Eigen::Vector2d(map.geotransform[0], map.geotransform[3])).norm(), 1e-6 * texel) << code;
      }
}

}  // namespace
}  // namespace nadir::tile
