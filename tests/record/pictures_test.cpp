#include "nadir/record/pictures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include "nadir/record/image_files.h"
#include "support/temporary_folder.h"

namespace nadir::record {
namespace {
using tile::SampleType;
using Rgb = std::array<int, 3>;

const ImageFiles& files() {
  static const ImageFiles* loaded = image_files().value();
  return *loaded;
}

template <class T, class F>
Image make(int width, int height, int channels, F&& value) {
  Image image{{}, tile::sample_type_of<T>, width, height, channels};
  image.samples.resize(image.view().size_bytes());
  auto* samples = reinterpret_cast<T*>(image.samples.data());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < channels; ++c) *samples++ = static_cast<T>(value(x, y, c));
    }
  }
  return image;
}

Rgb at(const Image& picture, int x, int y) {
  const auto* p = reinterpret_cast<const std::uint8_t*>(picture.samples.data()) + 3 * (y * picture.width + x);
  return {p[0], p[1], p[2]};
}

std::array<double, 3> mean(const Image& picture, Rectangle r) {
  std::array<double, 3> sum{};
  for (int y = r.y; y < r.y + r.height; ++y) {
    for (int x = r.x; x < r.x + r.width; ++x) {
      for (std::size_t c = 0; c < 3; ++c) sum[c] += at(picture, x, y)[c];
    }
  }
  for (double& s : sum) s /= r.width * r.height;
  return sum;
}

struct Drawn {
  Image picture;
  std::vector<Rectangle> places;
};

Drawn drawn(const ContactSheet& sheet) {
  const test::TemporaryFolder folder;
  const auto places = files().write_contact_sheet(folder.path() / "sheet.png", sheet);
  return {files().read(folder.path() / "sheet.png").value(), places.value()};
}

Drawn drawn(const FootprintMap& map) {
  const test::TemporaryFolder folder;
  const auto place = files().write_footprint_map(folder.path() / "map.png", map);
  return {files().read(folder.path() / "map.png").value(), {place.value()}};
}

TEST(ContactSheet, ThumbnailsOfColourFramesHaveTheMeanOfTheirFrames) {
  // Stripes of one pixel: sampling instead of averaging would show one of the two colours.
  const Image red = make<std::uint8_t>(640, 360, 3, [](int x, int, int c) { return c == 0 ? (x % 2 ? 255 : 55) : 20; });
  const Image blue =
      make<std::uint8_t>(101, 203, 4, [](int, int y, int c) { return c == 2 ? (y % 2 ? 210 : 190) : 80; });
  const Drawn sheet = drawn(ContactSheet{"Two", {{red.view(), "red"}, {blue.view(), "blue"}}});
  ASSERT_EQ(sheet.places.size(), 2u);
  const auto first = mean(sheet.picture, sheet.places[0]), second = mean(sheet.picture, sheet.places[1]);
  // Each thumbnail pixel is rounded by at most half; an odd number of stripes shifts the mean by at most 20/2/203.
  EXPECT_NEAR(first[0], 155, 0.5);
  EXPECT_NEAR(first[1], 20, 0.5);
  EXPECT_NEAR(second[0], 80, 0.5);
  EXPECT_NEAR(second[2], 200, 0.5 + 0.05);
}

TEST(ContactSheet, AThumbnailKeepsTheShapeOfItsFrameAndOverlapsNoOther) {
  const Image wide = make<std::uint8_t>(400, 100, 3, [](int, int, int) { return 200; });
  const Image tall = make<std::uint8_t>(90, 300, 1, [](int x, int, int) { return x; });
  ContactSheet sheet{"Many", {}};
  for (int i = 0; i < 30; ++i)
    sheet.frames.push_back({i % 2 ? tall.view() : wide.view(), "frame " + std::to_string(i)});
  const Drawn result = drawn(sheet);
  for (std::size_t i = 0; i < 30; ++i) {
    const Rectangle a = result.places[i];
    EXPECT_NEAR(static_cast<double>(a.width) / a.height, i % 2 ? 0.3 : 4.0, 0.03);
    EXPECT_TRUE(a.x >= 0 && a.y >= 0 && a.x + a.width <= result.picture.width &&
                a.y + a.height <= result.picture.height);
    for (std::size_t j = 0; j < i; ++j) {
      const Rectangle b = result.places[j];
      EXPECT_TRUE(a.x + a.width <= b.x || b.x + b.width <= a.x || a.y + a.height <= b.y || b.y + b.height <= a.y);
    }
  }
}

TEST(ContactSheet, ARadarFrameIsGreyFromItsDarkestToItsBrightestPart) {
  // -25 dB at the left to -5 dB at the right; a few corner reflectors must not set the range, and
  // single holes are averaged over: two by two pixels make one of the thumbnail.
  const Image radar = make<float>(960, 720, 1, [](int x, int y, int) {
    if (x % 50 == 0 && y % 50 == 0) return y % 100 ? 40.0f : std::numeric_limits<float>::quiet_NaN();
    return -25.0f + 20.0f * static_cast<float>(x) / 960.0f;
  });
  const Drawn sheet = drawn(ContactSheet{"", {{.image = radar.view(), .caption = "VV", .decibels = true}}});
  const Rectangle r = sheet.places[0];
  const auto column = [&](double fraction) {
    return mean(sheet.picture, {r.x + static_cast<int>(fraction * (r.width - 8)), r.y + r.height / 4, 8, r.height / 2});
  };
  EXPECT_LT(column(0)[0], 10);
  EXPECT_NEAR(column(0.5)[0], 127.5, 8);
  EXPECT_GT(column(1)[0], 245);
  EXPECT_EQ(column(0.5)[0], column(0.5)[1]);
  EXPECT_EQ(column(0.5)[0], column(0.5)[2]);
}

TEST(ContactSheet, DecibelsAreAveragedInPower) {
  // Columns of 0 dB and -20 dB average to 10 log10((1 + 0.01) / 2) = -2.967 dB in the left half, to -10 dB were
  // the decibels averaged. The right half runs through -10 .. 0 dB, so that the range is [-10, 0] within 2 percent.
  const Image radar = make<float>(960, 720, 1, [](int x, int y, int) {
    if (x < 480) return x % 2 ? 0.0f : -20.0f;
    return -10.0f + 10.0f * static_cast<float>(y) / 720.0f;
  });
  const auto left_half = [&](bool decibels) {
    const Drawn sheet = drawn(ContactSheet{"", {{.image = radar.view(), .decibels = decibels}}});
    const Rectangle r = sheet.places[0];
    return mean(sheet.picture, {r.x + 2, r.y + 2, r.width / 2 - 4, r.height - 4})[0];
  };
  EXPECT_NEAR(left_half(true), 255 * 7.033 / 10, 0.04 * 255);
  EXPECT_LT(left_half(false), 10);
}

TEST(ContactSheet, InvalidPixelsNeitherShowNorCountInTheMeanOrTheRange) {
  const Image image = make<std::uint16_t>(200, 200, 1, [](int x, int y, int) { return y < 100 ? 65535 : 1000 + x; });
  std::vector<std::uint8_t> valid(200 * 200, 1);
  std::fill(valid.begin(), valid.begin() + 100 * 200, std::uint8_t{0});
  const Drawn sheet = drawn(ContactSheet{"", {{.image = image.view(), .valid = valid}}});
  const Rectangle r = sheet.places[0];
  const auto top = mean(sheet.picture, {r.x, r.y, r.width, r.height / 2 - 1});
  EXPECT_LT(top[0], 60) << "invalid pixels show their value";
  const auto bottom = mean(sheet.picture, {r.x, r.y + r.height / 2 + 1, r.width, r.height / 2 - 1});
  EXPECT_NEAR(bottom[0], 127.5, 4) << "65535 is not in the range";
}

TEST(ContactSheet, WithoutAFontItHasTheSamePicturesAndNoWords) {
  const Image image = make<std::uint8_t>(320, 240, 3, [](int x, int y, int c) { return c == 0 ? x * 255 / 320 : y; });
  const ContactSheet sheet{"Title", {{image.view(), "caption"}}};
  const Drawn with = drawn(sheet);
  setenv("NADIR_FONT", "/nowhere/at-all.ttf", 1);
  const Drawn without = drawn(sheet);
  unsetenv("NADIR_FONT");
  EXPECT_EQ(with.places, without.places);
  EXPECT_EQ(mean(with.picture, with.places[0]), mean(without.picture, with.places[0]));
  const Rectangle title{0, 0, without.picture.width, with.places[0].y - 2};
  const auto blank = at(without.picture, 0, 0);
  EXPECT_EQ(mean(without.picture, title)[0], blank[0]);
  EXPECT_GT(mean(with.picture, title)[0], blank[0]) << "no font here either: this test needs fonts-dejavu-core";
}

FootprintMap grey_map(const Image& background) {
  FootprintMap map;
  map.background.image = background.view();
  map.metres_per_pixel = 1;
  return map;
}

const Image grey = make<std::uint8_t>(600, 400, 3, [](int, int, int) { return 100; });

int brightness(Rgb c) { return *std::max_element(c.begin(), c.end()); }

TEST(FootprintMap, OutlinesAreWhereTheyShouldBeAndTwoPixelsWide) {
  FootprintMap map = grey_map(grey);
  map.footprints = {{{200, 120}, {400, 120}, {400, 280}, {200, 280}}};
  const Drawn result = drawn(map);
  const Rectangle ground = result.places[0];
  EXPECT_EQ(ground.width, 600);
  EXPECT_EQ(ground.height, 400);
  const auto pixel = [&](int x, int y) { return at(result.picture, ground.x + x, ground.y + y); };
  // A line 2 px wide along x = 200 covers the pixels 199 and 200, and a dark halo of 2 px lies beside it.
  for (const int y : {140, 200, 260}) {
    EXPECT_EQ(brightness(pixel(199, y)), 255);
    EXPECT_EQ(brightness(pixel(200, y)), 255);
    EXPECT_LT(brightness(pixel(198, y)), 80);
    EXPECT_LT(brightness(pixel(201, y)), 80);
    EXPECT_EQ(pixel(195, y), (Rgb{100, 100, 100})) << "outside is left alone";
    EXPECT_EQ(brightness(pixel(399, y)), 255);
    EXPECT_EQ(brightness(pixel(400, y)), 255);
  }
  for (const int x : {220, 300, 380}) EXPECT_TRUE(brightness(pixel(x, 119)) == 255 && brightness(pixel(x, 280)) == 255);
  const Rgb inside = pixel(300, 200);
  EXPECT_NE(inside, (Rgb{100, 100, 100})) << "what was seen is tinted";
  for (const int channel : inside) EXPECT_NEAR(channel, 100, 30) << "and stays visible";
}

TEST(FootprintMap, TheFirstAndTheLastOutlineHaveTheEndsOfTheRamp) {
  FootprintMap map = grey_map(grey);
  for (int i = 0; i < 40; ++i)
    map.footprints.push_back({{100.0 + 8 * i, 100}, {160.0 + 8 * i, 100}, {160.0 + 8 * i, 300}, {100.0 + 8 * i, 300}});
  const Drawn result = drawn(map);
  const Rectangle ground = result.places[0];
  const Rgb first = at(result.picture, ground.x + 100, ground.y + 200),
            last = at(result.picture, ground.x + 160 + 8 * 39, ground.y + 200);
  EXPECT_TRUE(first[2] > 240 && first[0] < 80) << "blue";
  EXPECT_TRUE(last[0] > 240 && last[1] > 190 && last[2] < 80) << "yellow";
}

TEST(FootprintMap, ThePathRunsFromAGreenMarkToARedOne) {
  FootprintMap map = grey_map(grey);
  map.path = {{150, 200}, {300, 150}, {450, 200}};
  const Drawn result = drawn(map);
  const Rectangle ground = result.places[0];
  const auto pixel = [&](int x, int y) { return at(result.picture, ground.x + x, ground.y + y); };
  EXPECT_GT(pixel(150, 200)[1], pixel(150, 200)[0] + 100);
  EXPECT_GT(pixel(450, 200)[0], pixel(450, 200)[1] + 100);
  EXPECT_EQ(pixel(225, 174), (Rgb{255, 255, 255}))
      << "its centre lies 0.3 px from the line, which is 1 px thick on that side";
}

TEST(FootprintMap, PointsFarOutsideOrInTheSkyLeaveTheRestAsItIs) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  FootprintMap map = grey_map(grey);
  map.footprints = {{{300, 100}, {1e8, 100}, {1e8, 1e8}, {300, 1e8}}};
  const Drawn far = drawn(map);
  const Rectangle ground = far.places[0];
  EXPECT_EQ(brightness(at(far.picture, ground.x + 300, ground.y + 250)), 255);
  EXPECT_EQ(at(far.picture, ground.x + 290, ground.y + 250), (Rgb{100, 100, 100}));

  map.footprints = {{{300, 300}, {300, 150}, {nan, nan}, {infinity, 200}}};
  map.path = {{nan, 1}, {1e300, -1e300}};
  map.north_rad = nan;
  map.metres_per_pixel = nan;
  const Drawn sky = drawn(map);
  EXPECT_EQ(brightness(at(sky.picture, ground.x + 300, ground.y + 250)), 255) << "the side that sees ground is drawn";
  EXPECT_EQ(at(sky.picture, ground.x + 400, ground.y + 250), (Rgb{100, 100, 100}));
}

TEST(FootprintMap, TheScaleBarIsARoundLengthOfAtMostAQuarterOfTheWidth) {
  // A quarter of 600 px is 150 px: at 7 m a pixel 1050 m, so the bar is 1 km = 142.86 px long.
  FootprintMap map = grey_map(grey);
  map.metres_per_pixel = 7;
  const Drawn result = drawn(map);
  const Rectangle ground = result.places[0];
  const int y = ground.y + ground.height - 24;  // through the middle of the bar
  int first = -1, last = -1;
  for (int x = 0; x < ground.width; ++x) {
    if (brightness(at(result.picture, ground.x + x, y)) == 100) continue;
    if (first < 0) first = x;
    last = x;
  }
  EXPECT_NEAR(last + 1 - first, 1000.0 / 7 + 2 * 2, 1) << "with a frame of 2 px";
}

TEST(FootprintMap, TheNorthArrowTurnsWithNorth) {
  FootprintMap map = grey_map(grey);
  map.metres_per_pixel = 0;
  const auto tip_is_light = [&](double north_rad, int dx, int dy) {
    map.north_rad = north_rad;
    setenv("NADIR_FONT", "", 1);  // the arrow alone
    const Drawn result = drawn(map);
    unsetenv("NADIR_FONT");
    const Rectangle ground = result.places[0];
    const int cx = ground.x + ground.width - 44, cy = ground.y + 52;
    return at(result.picture, cx + dx, cy + dy) != (Rgb{100, 100, 100});
  };
  constexpr double quarter = std::numbers::pi / 2;
  EXPECT_TRUE(tip_is_light(0, 0, -17));
  EXPECT_FALSE(tip_is_light(0, 19, 0));
  EXPECT_TRUE(tip_is_light(quarter, 17, 0));
  EXPECT_FALSE(tip_is_light(quarter, 0, -19));
}

TEST(FootprintMap, ARadarBackgroundIsStretchedSoThatPeopleSeeIt) {
  const Image radar = make<float>(200, 100, 1, [](int x, int, int) { return x < 100 ? -25 : -5; });
  FootprintMap map;
  map.background = {.image = radar.view(), .decibels = true};
  const Drawn result = drawn(map);
  const Rectangle ground = result.places[0];
  EXPECT_LT(at(result.picture, ground.x + 20, ground.y + 80)[0], 20);
  EXPECT_GT(at(result.picture, ground.x + 120, ground.y + 80)[0], 235);
}

TEST(FootprintMap, ALongAttributionGetsMoreLinesBelowTheMap) {
  FootprintMap map = grey_map(grey);
  map.attribution = "Short";
  const Drawn one_line = drawn(map);
  for (int i = 0; i < 30; ++i) map.attribution += " \u00a9 OpenStreetMap contributors";
  const Drawn many_lines = drawn(map);
  EXPECT_GT(many_lines.picture.height, one_line.picture.height);
  EXPECT_EQ(many_lines.places, one_line.places);
  const Rectangle ground = many_lines.places[0];
  const Rectangle last_line{20, many_lines.picture.height - 22, 300, 12};
  EXPECT_GE(last_line.y, ground.y + ground.height);
  EXPECT_GT(mean(many_lines.picture, last_line)[0], at(many_lines.picture, 0, many_lines.picture.height - 1)[0] + 5)
      << "words in the last line too";
}

TEST(FootprintMap, WordsBeyondAsciiAreNotGarbled) {
  // As decoded by OpenImageIO 2.4.7 these two titles are the same: it keeps six bits of each character.
  FootprintMap map = grey_map(grey);
  const auto title = [&](const char* words) {
    map.title = words;
    return drawn(map).picture.samples;
  };
  EXPECT_TRUE(title("\u00a9") != title(")"));
  EXPECT_TRUE(title("S\u00e3o Paulo") != title("S#o Paulo"));
  EXPECT_TRUE(title("broken \xff\xc3") == title("broken \uFFFD\uFFFD")) << "what is not UTF-8 is shown as such";
}

TEST(FootprintMap, TheSameMapGivesTheSameBytes) {
  const test::TemporaryFolder folder;
  FootprintMap map = grey_map(grey);
  map.footprints = {{{20, 30}, {200.5, 31.7}, {190, 300}}, {{50, 60}, {250.5, 61.7}, {230, 330}}};
  map.title = "Zażółć gęślą jaźń · 中文 and a line that is far too long for the width of the picture it stands on";
  ASSERT_TRUE(files().write_footprint_map(folder.path() / "a.png", map));
  ASSERT_TRUE(files().write_footprint_map(folder.path() / "b.png", map));
  EXPECT_EQ(test::bytes_of(folder.path() / "a.png"), test::bytes_of(folder.path() / "b.png"));
}

}  // namespace
}  // namespace nadir::record
