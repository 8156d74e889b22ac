// The published homography means what OpenCV takes it for.
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "nadir/render/renderer.h"

namespace nadir::render {
namespace {

TEST(OpenCv, TheFullMapWarpedByThePublishedHomographyIsOurFrame) {
  const auto map = tile::Map::open(NADIR_SOURCE_DIR "/sim/demo/maps/kampala.tif").value();
  const int bands[] = {1, 2, 3};
  tile::Texels whole = map.read(0, {0, 0, map.width(), map.height()}, bands).value();
  const cv::Mat reference(map.height(), map.width(), CV_8UC3, whole.samples.data());

  const Scene scene = Scene::plane(map.center(), {}).with_layer("eo", map, {.bands = {1, 2, 3}});
  const Camera camera = Camera::pinhole(1280, 720, 1000, 1000, 640, 360).value();
  auto place = map.center();
  place.height_m = 74.4;  // a pixel on the ground is a texel: 1:1
  Renderer renderer;
  for (const auto& attitude : {geodesy::YawPitchRoll::degrees(0, 0, 0), geodesy::YawPitchRoll::degrees(33, 8, -6)}) {
    const Frame frame = renderer.render(scene, camera, camera_pose(place, attitude)).value();
    const Truth& truth = frame.truth();
    ASSERT_NEAR(*truth.magnification, 1, 0.05);
    cv::Mat h(3, 3, CV_64F), expected;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) h.at<double>(r, c) = (*truth.image_pixel_from_map_pixel)(r, c);
    cv::warpPerspective(reference, expected, h, {1280, 720}, cv::INTER_LINEAR);

    const auto difference = [&](const cv::Mat& other) {
      double sum = 0;
      std::int64_t count = 0;
      for (int y = 0; y < 720; ++y)
        for (int x = 0; x < 1280; ++x) {
          const std::size_t i = static_cast<std::size_t>(y * 1280 + x);
          if (!frame.layer().validity[i]) continue;
          for (int b = 0; b < 3; ++b)
            sum += std::abs(int(frame.pixels<std::uint8_t>()[3 * i + static_cast<std::size_t>(b)]) -
                            int(other.at<cv::Vec3b>(y, x)[b]));
          count += 3;
        }
      EXPECT_GT(count, 2'000'000);
      return sum / static_cast<double>(count);
    };
    EXPECT_LT(difference(expected), 2);
    // The same test sees half a pixel.
    const cv::Mat shift = (cv::Mat_<double>(3, 3) << 1, 0, 0.5, 0, 1, 0.5, 0, 0, 1);
    cv::Mat shifted;
    cv::warpPerspective(reference, shifted, shift * h, {1280, 720}, cv::INTER_LINEAR);
    EXPECT_GT(difference(shifted), 2);
    std::printf("mean difference %.3f grey levels; %.3f with half a pixel's shift\n", difference(expected),
                difference(shifted));
  }
}

}  // namespace
}  // namespace nadir::render
