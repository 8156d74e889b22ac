#include "nadir/mosaic/placement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "grids.h"

namespace nadir::mosaic {
namespace {

constexpr TexelType coordinates{Sample::F64, 2, false, false, std::nullopt};

/// Texels that hold the place of their own centres: bilinear interpolation returns the place that was asked for.
Block own_places(const Window& window) {
  return block_of<double>(coordinates, window, [](int x, int y, int b) { return (b ? y : x) + 0.5; });
}

struct Outcome {
  double worst = 0;         // source texels
  std::int64_t inside = 0;  // texels of the target whose footprint lies a texel inside the source's edge
  std::int64_t missed = 0;  // of these, untouched
  std::int64_t strays = 0;  // texels half a source texel or more outside, touched
};

/// What the projection library says of a target's texels in a source.
class Exactly {
 public:
  Exactly(const Grid& target, const Grid& source)
      : target_(target), source_(source), columns_(static_cast<int>(2 * target.width + 1)) {
    for (int y = 0; y < 2 * target.height + 1; ++y)
      for (int x = 0; x < columns_; ++x) points_.push_back(target.crs_from_texel * Eigen::Vector2d(x * 0.5, y * 0.5));
    transform_by_library(target.definition, source.definition, points_);
    const double middle = (source.crs_from_texel * Eigen::Vector2d(source.width / 2.0, source.height / 2.0)).x();
    for (auto& p : points_) {
      if (const auto turn = source.projection.turn()) p.x() = middle + std::remainder(p.x() - middle, *turn);
      p = source.crs_from_texel.inverse() * p;
    }
  }

  /// Lays places onto the target, and compares each.
  Outcome compare(const Placement& placement) const {
    Block result = block_of<double>(coordinates, whole(target_), [](int, int, int) { return -1.0; });
    const Window needed = placement.needed(whole(target_));
    if (needed.width > 0) placement.resample(coordinates, own_places(needed), result);
    Outcome outcome;
    for (int y = 0; y < target_.height; ++y)
      for (int x = 0; x < target_.width; ++x) {
        const Eigen::Vector2d found(at<double>(result, x, y, 0), at<double>(result, x, y, 1));
        bool inside = true;
        for (const int corner : {0, 1, 2, 3}) inside &= depth(place(x, y, corner % 2 * 2, corner / 2 * 2)) > 1;
        const bool touched = found.x() >= 0;
        outcome.inside += inside;
        outcome.missed += inside && !touched;
        outcome.strays += touched && !(depth(place(x, y, 1, 1)) > -0.5);  // not where NaN either
        if (inside && touched) outcome.worst = std::max(outcome.worst, (found - place(x, y, 1, 1)).norm());
      }
    return outcome;
  }

 private:
  /// Of texel (x, y) the corners and the middle, in halves of it.
  const Eigen::Vector2d& place(int x, int y, int half_x, int half_y) const {
    return points_[static_cast<std::size_t>((2 * y + half_y) * columns_ + 2 * x + half_x)];
  }
  double depth(const Eigen::Vector2d& p) const {
    return std::min(
        {p.x(), p.y(), static_cast<double>(source_.width) - p.x(), static_cast<double>(source_.height) - p.y()});
  }

  const Grid &target_, &source_;
  const int columns_;
  std::vector<Eigen::Vector2d> points_;
};

struct Pair {
  const char* name;
  Grid target, source;
  bool continental = false;  // texels of many kilometres, or a pole next door: patches are small
};

std::vector<Pair> pairs() {
  return {
      {"neighbouring UTM zones", around("EPSG:32614", -96, 45, 10, 500, 400),
       around("EPSG:32615", -96, 45, 10, 800, 800)},
      {"UTM zones, large texels far from the meridian", around("EPSG:32614", -92, 60, 500, 500, 500),
       around("EPSG:32616", -92, 60, 500, 400, 400)},
      {"UTM to degrees", around("EPSG:4326", 15, 50, 1e-4, 700, 600), around("EPSG:32633", 15.01, 50, 10, 600, 600)},
      {"degrees to Web Mercator", around("EPSG:3857", 10, 60, 400, 600, 600),
       around("EPSG:4326", 10, 60, 0.003, 500, 400)},
      {"degrees to Web Mercator across the equator", around("EPSG:3857", 10, 0, 10000, 700, 700),
       around("EPSG:4326", 10, 0, 0.1, 600, 600), true},
      {"degrees to the Arctic", around("EPSG:3413", -45, 80, 1000, 600, 600),
       around("EPSG:4326", -45, 80, 0.02, 1000, 300), true},
      {"degrees to the Arctic, close up", around("EPSG:3413", -45, 78, 40, 600, 600),
       around("EPSG:4326", -45, 78, 0.0005, 1500, 600)},
      {"the Antarctic to degrees", around("EPSG:4326", 30, -75, 0.002, 600, 400),
       around("EPSG:3031", 30, -75, 150, 500, 500)},
      {"UTM to Lambert's cone", around("EPSG:2154", 3, 46, 25, 600, 600), around("EPSG:32631", 3, 46, 20, 700, 600)},
      {"UTM zones across the antimeridian", around("EPSG:32601", 180, -17, 30, 600, 500),
       around("EPSG:32660", 180, -17, 30, 500, 600)},
      {"degrees across the antimeridian", north_up("EPSG:4326", 178, -16, 0.005, 800, 600),
       around("EPSG:32701", 180, -17, 600, 600, 500)},
      {"a source in negative degrees across the antimeridian", around("EPSG:32701", 180, -17.5, 150, 700, 600),
       north_up("EPSG:4326", -180.5, -17, 0.001, 1000, 1000)},
  };
}

TEST(Placement, KeepsTheToleranceAtEveryTexel) {
  for (const Pair& pair : pairs()) {
    const Exactly exactly(pair.target, pair.source);
    double worst_of_all = 0;
    for (const double tolerance : {0.5, 0.05, 0.002}) {
      const auto placement = Placement::create(pair.target, pair.source, {.tolerance_texels = tolerance}).value();
      const Outcome outcome = exactly.compare(placement);
      // Closed forms and the library agree within micrometres: far below a thousandth of any texel here.
      EXPECT_LE(outcome.worst, tolerance + 1e-6) << pair.name << " " << tolerance;
      EXPECT_GT(outcome.inside, 10000) << pair.name << ": these grids hardly meet";
      EXPECT_EQ(outcome.missed, 0) << pair.name << " " << tolerance;
      EXPECT_EQ(outcome.strays, 0) << pair.name << " " << tolerance;
      if (tolerance == 0.05 && !pair.continental) {
        EXPECT_LT(placement.exact_points(), pair.target.width * pair.target.height / 100)
            << pair.name << ": the exact mapping is meant to be rare";
      }
      worst_of_all = std::max(worst_of_all, outcome.worst / tolerance);
    }
    EXPECT_GT(worst_of_all, 0.05) << pair.name << " no longer exercises the tolerance";
  }
}

TEST(Placement, AnswersAroundThePoleWhereItIsOnePlaceAndWhereItIsALine) {
  // Degrees onto a polar grid with the pole in its middle: the seam at 180 degrees and all of the circle are there.
  const Grid polar = north_up("EPSG:3413", -1e6, 1e6, 10000, 200, 200);
  const Grid degrees = north_up("EPSG:4326", -180, 90, 0.1, 3600, 400);
  const auto onto_polar = Placement::create(polar, degrees, {}).value();
  const Outcome to_pole = Exactly(polar, degrees).compare(onto_polar);
  EXPECT_LE(to_pole.worst, 0.05 + 1e-6);
  EXPECT_EQ(to_pole.missed, 0);
  EXPECT_GT(to_pole.inside, 39000);

  const Grid band = north_up("EPSG:4326", -180, 90, 0.5, 720, 60);
  const auto onto_degrees = Placement::create(band, polar, {}).value();
  const Outcome from_pole = Exactly(band, polar).compare(onto_degrees);
  EXPECT_LE(from_pole.worst, 0.05 + 1e-6);
  EXPECT_EQ(from_pole.missed, 0);
  EXPECT_GT(from_pole.inside, 10000);
  EXPECT_EQ(onto_degrees.covered().width, 720) << "all longitudes meet at the pole";
}

TEST(Placement, CoversWhatItTouchesAndLittleMore) {
  for (const Pair& pair : pairs()) {
    const auto placement = Placement::create(pair.target, pair.source, {}).value();
    Block result = block_of<double>(coordinates, whole(pair.target), [](int, int, int) { return -1.0; });
    placement.resample(coordinates, own_places(placement.needed(whole(pair.target))), result);
    int left = 1 << 30, right = -1, top = 1 << 30, bottom = -1;
    for (int y = 0; y < pair.target.height; ++y)
      for (int x = 0; x < pair.target.width; ++x)
        if (at<double>(result, x, y) >= 0) {
          left = std::min(left, x), right = std::max(right, x);
          top = std::min(top, y), bottom = std::max(bottom, y);
        }
    const Window c = placement.covered();
    EXPECT_LE(left - c.x, 3) << pair.name;
    EXPECT_LE(top - c.y, 3) << pair.name;
    EXPECT_LE(c.x + c.width - 1 - right, 3) << pair.name;
    EXPECT_LE(c.y + c.height - 1 - bottom, 3) << pair.name;
  }
}

TEST(Placement, GivesTheSameBytesHoweverTheTargetIsDivided) {
  const TexelType type{Sample::U8, 3, false, false, std::nullopt};
  for (const double scale : {1.0, 2.7}) {  // the latter averages
    const Grid target = around("EPSG:32614", -93, 45, 30 * scale, 700, 600);
    const Grid source = around("EPSG:32615", -93, 45, 30, 800, 900);
    for (const auto interpolation : {Interpolation::Nearest, Interpolation::Bilinear, Interpolation::Cubic}) {
      const auto placement = Placement::create(target, source, {.interpolation = interpolation}).value();
      const auto texels = [](int x, int y, int b) { return static_cast<std::uint8_t>(x * 7 ^ y * 13 ^ b * 31); };
      const auto lay = [&](const Window& window, Block& onto) {
        const Window needed = placement.needed(window);
        if (needed.width > 0) placement.resample(type, block_of<std::uint8_t>(type, needed, texels), onto);
      };
      const auto empty = [&](const Window& w) {
        return block_of<std::uint8_t>(type, w, [](int, int, int) { return std::uint8_t{9}; });
      };
      Block at_once = empty(whole(target));
      lay(whole(target), at_once);
      std::uint32_t differ = 0;
      for (int y = 0; y < target.height; y += 97)
        for (int x = 0; x < target.width; x += 61) {
          const Window window{x, y, std::min(61, 700 - x), std::min(97, 600 - y)};
          Block part = empty(window);
          lay(window, part);
          for (int row = y; row < y + window.height; ++row)
            differ += std::memcmp(part.row(row), at_once.row(row) + x * 3, part.row_bytes()) != 0;
        }
      EXPECT_EQ(differ, 0u) << static_cast<int>(interpolation) << " " << scale;
    }
  }
}

TEST(Placement, IsAShiftWhereGridsDifferByWholeTexels) {
  const Grid target = north_up("EPSG:32614", 500000, 4000000, 10, 100, 80);
  EXPECT_EQ(Placement::create(target, north_up("EPSG:32614", 500070, 3999970, 10, 50, 50), {}).value().shift(),
            (std::array<std::int64_t, 2>{7, 3}));
  EXPECT_EQ(Placement::create(target, north_up("EPSG:32614", 499930.4, 4000029.7, 10, 50, 50), {}).value().shift(),
            (std::array<std::int64_t, 2>{-7, -3}));
  EXPECT_FALSE(Placement::create(target, north_up("EPSG:32614", 500070.6, 3999970, 10, 50, 50), {}).value().shift());
  EXPECT_FALSE(Placement::create(target, north_up("EPSG:32614", 500070, 3999970, 10.01, 50, 50), {}).value().shift());
  EXPECT_FALSE(Placement::create(target, north_up("EPSG:32615", 500070, 3999970, 10, 50, 50), {}).value().shift());
  const Grid degrees = north_up("EPSG:4326", 179, 10, 0.25, 100, 80);
  const auto turned = Placement::create(degrees, north_up("EPSG:4326", -180, 9, 0.25, 4, 4), {}).value();
  EXPECT_EQ(turned.shift(), (std::array<std::int64_t, 2>{4, 4})) << "the same place, a turn away";
  EXPECT_EQ(turned.exact_points(), 0);
}

TEST(Placement, AffineGridsAskNoProjection) {
  const Grid target = north_up("EPSG:32614", 500003, 4000000, 7, 300, 300);
  Grid source = north_up("EPSG:32614", 500000, 4000500, 10, 300, 300);
  source.crs_from_texel.linear() << 8, 3, 2, -9;  // rotated and sheared
  const auto placement = Placement::create(target, source, {}).value();
  const Outcome outcome = Exactly(target, source).compare(placement);
  EXPECT_LE(outcome.worst, 1e-6);  // coordinates of 4e6 m are doubles 5e-10 m apart
  EXPECT_EQ(outcome.missed, 0);
  EXPECT_GT(outcome.inside, 10000);
  EXPECT_EQ(placement.exact_points(), 0);
}

TEST(Placement, TellsHowManySourceTexelsAreInATexel) {
  const auto minification = [](const Grid& target, const Grid& source) {
    return Placement::create(target, source, {}).value().minification();
  };
  const Grid source = around("EPSG:32614", -99, 45, 10, 500, 500);
  EXPECT_NEAR(minification(around("EPSG:32614", -99, 45, 25, 100, 100), source), 2.5, 1e-9);
  // At 45 degrees a metre of Web Mercator is cos(45 degrees) metres on the ground, within 0.4 % for the ellipsoid.
  EXPECT_NEAR(minification(around("EPSG:3857", -99, 45, 10, 100, 100), source), std::sqrt(0.5), 0.005);
  // A degree of latitude is the longer side: 111.1 km.
  EXPECT_NEAR(minification(around("EPSG:4326", -99, 45, 1e-3, 100, 100), source), 11.11, 0.02);
}

TEST(Placement, LeavesUntouchedWhatNoMappingReaches) {
  // The pole has no place in Web Mercator: texels of the Arctic beyond 85 degrees find no source, the others do.
  const Grid polar = north_up("EPSG:3413", -2e6, 2e6, 20000, 200, 200);
  const Grid mercator = north_up("EPSG:3857", -20037508.342789244, 20037508.342789244, 40075.016685578488, 1000, 500);
  const auto placement = Placement::create(polar, mercator, {}).value();
  const Outcome outcome = Exactly(polar, mercator).compare(placement);
  EXPECT_EQ(outcome.strays, 0);
  EXPECT_EQ(outcome.missed, 0);
  EXPECT_GT(outcome.inside, 20000);
  // Far from each other: nothing is needed.
  const Grid here = around("EPSG:32614", -99, 45, 10, 300, 300);
  const auto apart = Placement::create(here, around("EPSG:32632", 9, 45, 10, 300, 300), {});
  if (apart) {
    EXPECT_EQ(apart->covered().width, 0);
    EXPECT_EQ(apart->needed(whole(here)).width, 0);
  } else {
    EXPECT_EQ(apart.error().kind, Error::Kind::Unsupported);
  }
}

TEST(Placement, SaysSoWhereNoTexelIsDefined) {
  // 90 degrees from its meridian a transverse Mercator projection goes to infinity.
  const Grid target = around("EPSG:32614", -99, 0, 10, 300, 300);
  const auto placement = Placement::create(target, around("EPSG:32629", -9, 0.1, 10, 300, 300), {});
  ASSERT_FALSE(placement);
  EXPECT_EQ(placement.error().kind, Error::Kind::Unsupported);
  EXPECT_NE(placement.error().message.find("EPSG:32614"), std::string::npos) << placement.error().message;

  EXPECT_EQ(Placement::create(target, target, {.tolerance_texels = 0}).error().kind, Error::Kind::Malformed);
  EXPECT_EQ(Placement::create(target, target, {.tolerance_texels = NAN}).error().kind, Error::Kind::Malformed);
  EXPECT_EQ(Placement::create(target, target, {.power = true, .scale = 0}).error().kind, Error::Kind::Malformed);
  Grid flat = target;
  flat.crs_from_texel.linear() << 1, 1, 1, 1;
  EXPECT_EQ(Placement::create(target, flat, {}).error().kind, Error::Kind::Malformed);
}

}  // namespace
}  // namespace nadir::mosaic
