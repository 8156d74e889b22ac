// Nothing in a frame marks where its blocks or levels meet.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "nadir/render/homography.h"
#include "nadir/render/patches.h"
#include "support/scene.h"
#include "support/temporary_folder.h"

namespace nadir::render {
namespace {

constexpr int side = 512, half_block = block_px / 2;

/// A view over the Kampala map, from a texel a pixel at its lower edge to six at its upper one, whose grid of blocks
/// may begin half a block before the image's left and upper edges: pixels then lie in the middle of blocks that lie at
/// their borders otherwise, and ought to show the same.
class Seams : public testing::Test {
 protected:
  Frame render(const RenderOptions& options, bool shifted) {
    const double middle = side / 2.0 + (shifted ? half_block : 0);
    const int size = side + (shifted ? half_block : 0);
    geodesy::Geodetic place = map.center();
    place.height_m = 60;
    place.lon_rad -= 131 / 6.378e6;
    return renderer
        .render(Scene::plane(map.center(), {}).with_layer("eo", map, {.bands = {2}}),
                Camera::pinhole(size, size, 900, 900, middle, middle).value(),
                camera_pose(place, geodesy::YawPitchRoll::degrees(90, 58, 0)), options)
        .value();
  }

  tile::Map map = tile::Map::open(NADIR_SOURCE_DIR "/sim/demo/maps/kampala.tif").value();
  Renderer renderer;
};

/// Values of a frame by places in the image whose grid is not shifted.
class Values {
 public:
  explicit Values(const Frame& frame)
      : pixels_(frame.pixels<std::uint8_t>()), width_(frame.layer().width), shift_(width_ - side) {}
  double operator()(int x, int y) const {
    return pixels_[static_cast<std::size_t>((y + shift_) * width_ + x + shift_)];
  }

 private:
  std::span<const std::uint8_t> pixels_;
  int width_, shift_;
};

double rms_difference(const Values& a, const Values& b, int first_row, int rows) {
  double sum = 0;
  for (int y = first_row; y < first_row + rows; ++y)
    for (int x = 0; x < side; ++x) sum += std::pow(a(x, y) - b(x, y), 2);
  return std::sqrt(sum / rows / side);
}

/// Root mean square of steps between a row and the one above.
double step_into_row(const Values& value, int row) {
  double sum = 0;
  for (int x = 0; x < side; ++x) sum += std::pow(value(x, row) - value(x, row - 1), 2);
  return std::sqrt(sum / side);
}

/// Root mean square of steps between a column and the one before, in some rows.
double step_into_column(const Values& value, int column, int first_row, int rows) {
  double sum = 0;
  for (int y = first_row; y < first_row + rows; ++y) sum += std::pow(value(column, y) - value(column - 1, y), 2);
  return std::sqrt(sum / rows);
}

/// Levels that `draft` is meant to take where the view's blocks lie: the nearest to what one sample a pixel needs in
/// the block's middle. `y`: any row of the block.
struct DraftLevels {
  const Truth& truth;  // of the frame whose grid is not shifted
  long nearest(double middle_y) const {
    const Eigen::Matrix2d j =
        jacobian(*truth.map_pixel_from_image_pixel, Eigen::Vector2d(side / 2.0 - 0.5, middle_y - 0.5));
    return std::max(0L, std::lround(std::log2(std::sqrt(std::abs(j.determinant())))));
  }
  long here(int y) const { return nearest(y / block_px * block_px + half_block); }
  long shifted(int y) const { return nearest((y + half_block) / block_px * block_px); }
};

// What two frames of one view may differ in: values of equal samples, rounded after geometry that was fitted anew.
constexpr double rounding_rms = 0.05;

TEST_F(Seams, BlocksOfDraftShowWhatAnyOtherOfTheirLevelWould) {
  const Frame frame = render({.quality = Quality::draft}, false), other = render({.quality = Quality::draft}, true);
  const Values here(frame), shifted(other);
  const DraftLevels levels{frame.truth()};
  int same = 0, differ = 0;
  for (int y = 0; y < side; y += half_block) {
    const double rms = rms_difference(here, shifted, y, half_block);
    if (levels.here(y) == levels.shifted(y)) {
      ++same;
      EXPECT_LT(rms, rounding_rms) << "row " << y;
      for (int x = block_px; x < side; x += block_px)
        EXPECT_NEAR(step_into_column(here, x, y, half_block), step_into_column(shifted, x, y, half_block), rounding_rms)
            << x << ", " << y;
    } else {
      ++differ;
      EXPECT_GT(rms, 10 * rounding_rms) << "row " << y << ": levels no longer look different";
    }
  }
  EXPECT_GE(same, 10);
  EXPECT_GE(differ, 3) << "the view no longer spans levels";
}

TEST_F(Seams, BordersOfBlocksOfDraftShowNoMoreThanTheChangeOfLevel) {
  const Frame frame = render({.quality = Quality::draft}, false), other = render({.quality = Quality::draft}, true);
  const Values here(frame), shifted(other);
  const DraftLevels levels{frame.truth()};
  int within = 0, between = 0;
  for (int y = block_px; y < side; y += block_px) {
    const long above = levels.here(y - 1), below = levels.here(y);
    const double ratio = step_into_row(here, y) / step_into_row(shifted, y);  // there, inside of a block
    EXPECT_LE(std::abs(above - below), 1) << "row " << y;
    if (above == below && below == levels.shifted(y)) {
      ++within;
      EXPECT_NEAR(ratio, 1, 0.005) << "row " << y;
    } else {
      ++between;
      // One side is sharper than the other, and what is on both correlates: found are 0.85 and 1.1
      EXPECT_LT(ratio, 1.15) << "row " << y;
    }
  }
  EXPECT_GE(within, 4);
  EXPECT_GE(between, 2);
}

TEST_F(Seams, FramesThatBlendLevelsDoNotTellWhereTheirBlocksLie) {
  for (const Quality quality : {Quality::balanced, Quality::best}) {
    const Frame frame = render({.quality = quality}, false), other = render({.quality = quality}, true);
    const Values here(frame), shifted(other);
    for (int y = block_px; y < side; y += block_px)
      EXPECT_NEAR(step_into_row(here, y) / step_into_row(shifted, y), 1, 0.005) << to_string(quality) << ", row " << y;
    for (int x = block_px; x < side; x += block_px)
      EXPECT_NEAR(step_into_column(here, x, 0, side) / step_into_column(shifted, x, 0, side), 1, 0.005)
          << to_string(quality) << ", column " << x;
    // Blocks may take a sample a pixel more or less, within what rounds to 0.29
    EXPECT_LT(rms_difference(here, shifted, 0, side), 0.3) << to_string(quality);
  }
}

}  // namespace
}  // namespace nadir::render
