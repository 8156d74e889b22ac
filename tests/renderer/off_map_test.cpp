#include <gtest/gtest.h>

#include <cmath>

#include "support/scene.h"
#include "support/temporary_folder.h"

namespace nadir::render {
namespace {

class OffMapRule : public testing::TestWithParam<GDALDataType> {
 protected:
  OffMapRule() {
    test::SyntheticMap synthetic = test::utm_map(200, 1);
    synthetic.type = GetParam();
    synthetic.value = [](int, int, int, int) { return 7; };
    test::write_map(synthetic, folder.file("m.tif"));
    map.emplace(tile::Map::open(folder.file("m.tif")).value());
    scene.emplace(Scene::plane(map->center(), {}).with_layer("eo", *map));
  }
  /// At 200 m, 100 pixels of a metre look over the middle half of the map; at 400 m the map is the middle half of the
  /// view.
  auto render(double height_m, const RenderOptions& options) {
    return Renderer().render(*scene, test::square_camera(100, 100), test::over_centre(*map, height_m), options);
  }

  test::TemporaryFolder folder;
  std::optional<tile::Map> map;
  std::optional<Scene> scene;
};

TEST_P(OffMapRule, MaskMarksWhatIsNotThere) {
  const Frame frame = render(400, {.off_map = OffMap::Mask}).value();
  EXPECT_NEAR(frame.truth().valid_fraction, 0.25, 0.011) << "half by half, to a pixel";
  EXPECT_EQ(frame.layer().validity[50 * 100 + 50], 1);
  EXPECT_EQ(frame.layer().validity[50 * 100 + 20], 0);
  if (GetParam() == GDT_Float32)
    EXPECT_TRUE(std::isnan(frame.pixels<float>()[50 * 100 + 20]));
  else
    EXPECT_EQ(frame.pixels<std::uint8_t>()[50 * 100 + 20], 0);
}

TEST_P(OffMapRule, FillGivesItAValue) {
  const Frame frame = render(400, {.off_map = OffMap::Fill, .fill_value = 99}).value();
  const double filled = GetParam() == GDT_Float32 ? frame.pixels<float>()[0] : frame.pixels<std::uint8_t>()[0];
  const double seen = GetParam() == GDT_Float32 ? frame.pixels<float>()[5050] : frame.pixels<std::uint8_t>()[5050];
  EXPECT_EQ(filled, 99);
  EXPECT_EQ(seen, 7);
}

TEST_P(OffMapRule, RejectMakesNoFrameUnlessAllCornersAreOnTheMap) {
  EXPECT_TRUE(render(190, {.off_map = OffMap::Reject}));
  const auto beyond = render(210, {.off_map = OffMap::Reject});
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().kind, Error::Kind::OutsideMap);
  EXPECT_NE(beyond.error().message.find("top left corner"), std::string::npos) << beyond.error().message;
}

TEST_P(OffMapRule, ACameraThatSeesNothingGivesAFrameThatSaysSo) {
  for (const CameraPose& pose :
       {test::over_centre(*map, -10),                                                     // below the ground
        camera_pose(geodesy::Geodetic::degrees(47, -99, 500), {0, std::numbers::pi, 0}),  // looking up
        look_down(geodesy::Geodetic::degrees(46, -98, 500), geodesy::Degrees{0})}) {      // far away
    const auto frame = Renderer().render(*scene, test::square_camera(100, 100), pose);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->truth().valid_fraction, 0);
    EXPECT_EQ(frame->counters().cells, 0);
    EXPECT_EQ(frame->counters().windows_read, 0);
  }
}

TEST_P(OffMapRule, APlaneWhereTheMapsCrsHasNoCoordinatesIsRefused) {
  // Zone 14 is around 99 W and reaches 50 degrees from there
  const auto far = Scene::plane(geodesy::Geodetic::degrees(5, -40, 0), {}).with_layer("eo", *map).check();
  ASSERT_FALSE(far);
  for (const char* words : {"m.tif", "latitude 5, longitude -40", "EPSG:32614", "origin on the map", "gdalwarp"})
    EXPECT_NE(far.error().message.find(words), std::string::npos) << far.error().message;
  EXPECT_TRUE(Scene::plane(geodesy::Geodetic::degrees(5, -55, 0), {}).with_layer("eo", *map).check());
  EXPECT_TRUE(Scene::ellipsoid(geodesy::Geodetic::degrees(5, -40, 0), 0).with_layer("eo", *map).check())
      << "seen from there it may be in view";
}

INSTANTIATE_TEST_SUITE_P(Types, OffMapRule, testing::Values(GDT_Byte, GDT_Float32),
                         [](const auto& tested) { return std::string(GDALGetDataTypeName(tested.param)); });

}  // namespace
}  // namespace nadir::render
