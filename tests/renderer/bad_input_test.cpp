// Maps that change under a renderer, that hold nothing or numbers that are none, and frames of a pixel.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "support/scene.h"
#include "support/temporary_folder.h"

namespace nadir::render {
namespace {

namespace fs = std::filesystem;

constexpr std::array qualities = {Quality::draft, Quality::balanced, Quality::best};
constexpr std::array filters = {Filter::Nearest, Filter::Bilinear, Filter::Bicubic, Filter::Mip, Filter::Reference};

/// A map of four by four tiles that a renderer has seen the north-west of.
class ChangingMap : public testing::Test {
 protected:
  ChangingMap() {
    write("m.tif", 0);
    fs::last_write_time(folder.file("m.tif"), fs::file_time_type::clock::now() - std::chrono::seconds(10));
    map.emplace(tile::Map::open(folder.file("m.tif")).value());
    scene.emplace(Scene::plane(map->center(), {}).with_layer("eo", *map));
    untouched = at(north_west).value().layer().samples;
  }
  void write(const std::string& name, int more) {
    test::SyntheticMap synthetic = test::utm_map(512, 1);
    synthetic.type = GDT_Byte;
    synthetic.value = [=](int, int, int col, int row) { return (3 * col + 5 * row) % 200 + more; };
    test::write_map(synthetic, folder.file(name));
  }
  struct Place {
    double north_m, east_m;
  };
  static constexpr Place north_west{150, -150}, south_east{-150, 150};
  Result<Frame> at(const Place& place) {
    CameraPose pose = test::over_centre(*map, 100);
    const auto ecef_from_enu = scene->surface().frame().ecef_from_enu();
    pose.origin += ecef_from_enu.rotation * Eigen::Vector3d(place.east_m, place.north_m, 0);
    return renderer.render(*scene, test::square_camera(64, 100), pose);
  }

  test::TemporaryFolder folder;
  std::optional<tile::Map> map;
  std::optional<Scene> scene;
  Renderer renderer;
  FrameBuffer<std::byte> untouched;
};

TEST_F(ChangingMap, DeletedOrReplacedByAnotherFileIsReadOnAsItWasOpened) {
  const auto before =
      Renderer().render(*scene, test::square_camera(64, 100), test::over_centre(*map, 100)).value().layer().samples;
  write("other.tif", 55);
  fs::rename(folder.file("other.tif"), folder.file("m.tif"));
  EXPECT_EQ(at({0, 0}).value().layer().samples, before);
  fs::remove(folder.file("m.tif"));
  EXPECT_EQ(at(south_east).value().truth().valid_fraction, 1);
}

TEST_F(ChangingMap, CutShortFailsWhereItIsReadAndSaysSo) {
  fs::resize_file(folder.file("m.tif"), fs::file_size(folder.file("m.tif")) / 3);
  const auto frame = at(south_east);
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().kind, Error::Kind::Io);
  for (const char* words : {"m.tif", "bytes when it was opened"})
    EXPECT_NE(frame.error().message.find(words), std::string::npos) << frame.error().message;
  EXPECT_EQ(at(north_west).value().layer().samples, untouched) << "what is in memory stays";
}

TEST_F(ChangingMap, WrittenAnewInItsPlaceFailsInsteadOfMixingOldAndNew) {
  write("other.tif", 55);
  std::ofstream(folder.file("m.tif"), std::ios::binary) << test::bytes_of(folder.file("other.tif"));
  const auto frame = at(south_east);
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().kind, Error::Kind::Io);
  EXPECT_NE(frame.error().message.find("m.tif: was written to"), std::string::npos) << frame.error().message;
  EXPECT_EQ(at(north_west).value().layer().samples, untouched);

  const auto again = tile::Map::open(folder.file("m.tif")).value();
  EXPECT_EQ(renderer
                .render(Scene::plane(again.center(), {}).with_layer("eo", again), test::square_camera(64, 100),
                        test::over_centre(again, 100))
                .value()
                .truth()
                .valid_fraction,
            1)
      << "the renderer goes on with the map opened again";
}

TEST(NotANumber, StaysWithTheSamplesThatTouchIt) {
  const test::TemporaryFolder folder;
  constexpr int hole = 130;
  const auto make = [&](const std::string& name, bool with_hole) {
    test::SyntheticMap synthetic = test::utm_map(256, 1);
    synthetic.value = [=](int, int, int col, int row) {
      return with_hole && col == hole && row == hole ? std::numeric_limits<double>::quiet_NaN()
                                                     : 100 + 30 * std::sin(0.3 * col) + 20 * std::cos(0.2 * row);
    };
    test::write_map(synthetic, folder.file(name));
    return tile::Map::open(folder.file(name)).value();
  };
  const auto whole = make("whole.tif", false), holed = make("holed.tif", true);
  constexpr int side = 64;
  for (const Filter filter : filters)
    for (const double texels : {0.2, 1.0, 3.0}) {  // a pixel
      const auto render = [&](const tile::Map& map) {
        return Renderer()
            .render(Scene::plane(map.center(), {}).with_layer("f", map), test::square_camera(side, 100),
                    test::over_centre(map, 100 * texels), {.filter = filter})
            .value();
      };
      const Frame frame = render(holed), expected = render(whole);
      const auto found = frame.pixels<float>(), right = expected.pixels<float>();
      const Eigen::Matrix3d& h = *frame.truth().map_pixel_from_image_pixel;
      int touched = 0, invalid = 0;
      for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
          const auto i = static_cast<std::size_t>(y * side + x);
          const bool valid = frame.layer().validity[i];
          invalid += !valid;
          ASSERT_EQ(std::isnan(found[i]), !valid) << to_string(filter) << ", " << texels;
          // Two texels to each side of a cubic sample, one of others; and half of a pixel's footprint
          const Eigen::Vector2d away = (apply(h, Eigen::Vector2d(x, y)) - Eigen::Vector2d(hole, hole)).cwiseAbs();
          if (away.maxCoeff() <= (filter == Filter::Bicubic ? 2 : 1) + texels / 2) {
            ++touched;
            if (valid) {
              ASSERT_GT(found[i], 40) << "a mean of valid texels, which are from 50 to 150";
            }
          } else {
            // Where a block holds invalid texels, weights are summed too: a rounding more
            ASSERT_NEAR(found[i], right[i], 1e-4) << to_string(filter) << ", " << texels << ": " << x << ", " << y;
          }
        }
      EXPECT_GT(touched, 0);
      // Invalid is what lies on the texel for the most part: five pixels a side, in a blend the nearer ones of them
      EXPECT_GE(invalid, texels < 1 ? 9 : 0) << to_string(filter);
      EXPECT_LE(invalid, texels < 1 ? 25 : 1) << to_string(filter);
    }
}

TEST(NotANumber, AMapOfNothingElseIsAFrameOfNothing) {
  const test::TemporaryFolder folder;
  const auto all_invalid = [&](GDALDataType type, double value, std::optional<double> nodata, bool masked) {
    test::SyntheticMap synthetic = test::utm_map(256, 1);
    synthetic.type = type;
    synthetic.factors = {2};
    synthetic.nodata = nodata;
    synthetic.value = [=](int, int, int, int) { return value; };
    if (masked) {
      synthetic.mask = true;
      synthetic.mask_value = [](int, int) { return 0; };
    }
    test::write_map(synthetic, folder.file("m.tif"));
    return tile::Map::open(folder.file("m.tif")).value();
  };
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
  for (const tile::Map& map : {all_invalid(GDT_Float32, nan, {}, false), all_invalid(GDT_Float32, infinite, {}, false),
                               all_invalid(GDT_Float32, -9999, -9999, false), all_invalid(GDT_Byte, 7, 7, false),
                               all_invalid(GDT_Byte, 7, {}, true)})
    for (const Quality quality : qualities) {
      const Frame frame = Renderer()
                              .render(Scene::plane(map.center(), {}).with_layer("f", map), test::square_camera(64, 100),
                                      test::over_centre(map, 150), {.quality = quality})
                              .value();
      EXPECT_EQ(frame.truth().valid_fraction, 0);
      EXPECT_GT(frame.truth().tiles, 0) << "it was looked at";
      EXPECT_TRUE(frame.truth().damage.empty());
      if (frame.layer().type == tile::SampleType::Float32)
        EXPECT_TRUE(std::all_of(frame.pixels<float>().begin(), frame.pixels<float>().end(),
                                [](float v) { return std::isnan(v); }));
      else
        EXPECT_TRUE(std::all_of(frame.pixels<std::uint8_t>().begin(), frame.pixels<std::uint8_t>().end(),
                                [](std::uint8_t v) { return v == 0; }));
    }
}

TEST(SmallFrames, OfOnePixelOneRowOrOneColumnAreThatPartOfALargerOne) {
  const test::TemporaryFolder folder;
  test::SyntheticMap synthetic = test::utm_map(512, 1);
  synthetic.factors = {2, 4};
  synthetic.value = [](int level, int, int col, int row) { return ((col << level) + 0.1 * (row << level)); };
  test::write_map(synthetic, folder.file("m.tif"));
  const auto map = tile::Map::open(folder.file("m.tif")).value();
  const Scene scene = Scene::plane(map.center(), {}).with_layer("f", map);
  Renderer renderer;
  constexpr int large = 65, middle = large / 2;
  for (const Quality quality : qualities)
    for (const double height_m : {50.0, 100.0, 300.0}) {
      const auto render = [&](int width, int height) {
        return renderer
            .render(scene, Camera::pinhole(width, height, 100, 100, width / 2.0, height / 2.0).value(),
                    test::over_centre(map, height_m), {.quality = quality})
            .value();
      };
      const Frame whole = render(large, large);
      const auto right = whole.pixels<float>();
      for (const auto& [width, height] : {std::pair{1, 1}, {large, 1}, {1, large}}) {
        const Frame frame = render(width, height);
        EXPECT_EQ(frame.truth().valid_fraction, 1);
        EXPECT_TRUE(frame.truth().map_pixel_from_image_pixel);
        const auto found = frame.pixels<float>();
        ASSERT_EQ(found.size(), static_cast<std::size_t>(width * height));
        for (int y = 0; y < height; ++y)
          for (int x = 0; x < width; ++x)
            ASSERT_NEAR(found[static_cast<std::size_t>(y * width + x)],
                        right[static_cast<std::size_t>((height == 1 ? middle : y) * large + (width == 1 ? middle : x))],
                        1e-3)
                << width << " x " << height << ", " << to_string(quality) << ", " << height_m << " m";
      }
    }
}

TEST(SmallFrames, ACameraOnTheGroundSeesNoneOfIt) {
  const test::TemporaryFolder folder;
  test::SyntheticMap synthetic = test::utm_map(256, 1);
  synthetic.value = [](int, int, int, int) { return 1; };
  test::write_map(synthetic, folder.file("m.tif"));
  const auto map = tile::Map::open(folder.file("m.tif")).value();
  const Scene scene = Scene::plane(map.center(), {}).with_layer("f", map);
  const double inside_earth_m = -6'000'000;
  for (const double height_m : {0.0, -1e-3, -1000.0, inside_earth_m}) {
    const auto frame = Renderer().render(scene, test::square_camera(32, 30), test::over_centre(map, height_m));
    ASSERT_TRUE(frame) << height_m;
    EXPECT_EQ(frame->truth().valid_fraction, 0) << height_m;
    EXPECT_EQ(frame->counters().cells, 0) << height_m;
  }
  const Frame close = Renderer().render(scene, test::square_camera(32, 30), test::over_centre(map, 1e-2)).value();
  EXPECT_EQ(close.truth().valid_fraction, 1) << "a centimetre above it sees a centimetre";
}

}  // namespace
}  // namespace nadir::render
