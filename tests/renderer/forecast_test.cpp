// The error that a plan expects, beside the error that its frame has.
#include <gtest/gtest.h>

#include <cmath>

#include "nadir/pyramid/build.h"
#include "nadir/render/expected_error.h"
#include "support/scene.h"
#include "support/temporary_folder.h"

namespace nadir::render {
namespace {

tile::Map built(const test::TemporaryFolder& folder, const std::string& name) {
  pyramid::BuildOptions options;
  options.sources = {NADIR_SOURCE_DIR "/sim/demo/maps/" + name};
  options.output = folder.file(name);
  EXPECT_TRUE(pyramid::build(options));
  return tile::Map::open(folder.file(name)).value();
}

/// Root of the mean square of differences.
double rmse(const FrameLayer& a, const FrameLayer& b) {
  double sum = 0, count = 0;
  tile::with_sample_type(a.type, [&]<class T>(T) {
    const T *x = reinterpret_cast<const T*>(a.samples.data()), *y = reinterpret_cast<const T*>(b.samples.data());
    const auto bands = static_cast<std::size_t>(a.bands);
    for (std::size_t i = 0; i < a.samples.size() / sizeof(T); ++i) {
      if (!a.validity[i / bands] || !b.validity[i / bands]) continue;
      sum += std::pow(static_cast<double>(x[i]) - static_cast<double>(y[i]), 2);
      ++count;
    }
  });
  return std::sqrt(sum / count);
}

/// Looks at the map's centre from where a pixel there spans `texels`.
CameraPose pose(const tile::Map& map, double focal_px, double texels, double pitch_deg) {
  const double range = texels * map.texel_size_m().x() * focal_px,
               back = range * std::sin(geodesy::to_radians(pitch_deg));
  geodesy::Geodetic place = map.center();
  place.lat_rad -= back * std::cos(0.5) / 6371e3;
  place.lon_rad -= back * std::sin(0.5) / (6371e3 * std::cos(place.lat_rad));
  place.height_m = range * std::cos(geodesy::to_radians(pitch_deg));
  return camera_pose(place, geodesy::YawPitchRoll{0.5, geodesy::to_radians(pitch_deg), 0});
}

TEST(Forecast, ErrorsAreExpectedWithinAFactorOfThree) {
  const test::TemporaryFolder folder;
  Renderer renderer;
  double logarithms = 0, count = 0;
  for (const auto& [name, bands] :
       {std::pair("kampala.tif", std::vector{1, 2, 3}), {"naip_2010.tif", {1, 2, 3}}, {"spain_s2.tif", {4, 3, 2}}}) {
    const auto map = built(folder, name);
    const Scene scene = Scene::plane(map.center(), {}).with_layer("l", map, {.bands = bands});
    const Camera camera = Camera::pinhole(160, 120, 320, 320, 80, 60).value();
    for (const double texels : {1.3, 2.0, 3.0, 4.5})
      for (const double pitch_deg : {0.0, 55.0}) {
        const CameraPose view = pose(map, 320, texels, pitch_deg);
        const Frame reference = renderer.render(scene, camera, view, {.filter = Filter::Reference}).value();
        EXPECT_FALSE(reference.truth().expected_rmse);
        double least = 0.2;  // rounding; and a twentieth of draft's: what is better by as much need not be told apart
        for (const Quality quality : {Quality::draft, Quality::balanced, Quality::best}) {
          const Frame frame = renderer.render(scene, camera, view, {.quality = quality}).value();
          ASSERT_TRUE(frame.truth().expected_rmse);
          const double error = rmse(frame.layer(), reference.layer());
          if (quality == Quality::draft) least = std::max(least, error / 20);
          const double found = std::hypot(error, least);
          const double ratio = *frame.truth().expected_rmse / found;
          EXPECT_TRUE(ratio > 0.4 && ratio < 3)
              << name << ", " << texels << " texels, pitch " << pitch_deg << ", " << to_string(quality) << ": expected "
              << *frame.truth().expected_rmse << ", found " << found;
          logarithms += std::log(ratio);
          ++count;
        }
      }
  }
  const double mean = std::exp(logarithms / count);
  std::printf("expected errors are %.2f of those found\n", mean);
  EXPECT_GT(mean, 0.8);
  EXPECT_LT(mean, 1.25);
}

TEST(Forecast, AGreatestErrorTakesTheCheapestSamplingThatKeepsIt) {
  const test::TemporaryFolder folder;
  const auto map = built(folder, "kampala.tif");
  const Scene scene = Scene::plane(map.center(), {}).with_layer("l", map, {.bands = {1, 2, 3}});
  const Camera camera = Camera::pinhole(160, 120, 320, 320, 80, 60).value();
  Renderer renderer;
  const CameraPose view = pose(map, 320, 3, 20);
  std::int64_t samples = 0;
  for (const double most : {30.0, 4.0, 2.0, 1.0}) {
    const Frame frame = renderer.render(scene, camera, view, {.max_error = most}).value();
    EXPECT_LE(*frame.truth().expected_rmse, most);
    EXPECT_GE(frame.counters().samples, samples);
    samples = frame.counters().samples;
  }
  EXPECT_EQ(renderer.render(scene, camera, view, {.max_error = 30}).value().truth().filter, Filter::Bilinear);
  EXPECT_GT(*renderer.render(scene, camera, view, {.max_error = 1e-3}).value().truth().expected_rmse, 1e-3)
      << "the finest there is, and its record says so";

  const auto plain = tile::Map::open(NADIR_SOURCE_DIR "/sim/demo/maps/kampala.tif").value();
  const Scene other = Scene::plane(plain.center(), {}).with_layer("l", plain, {.bands = {1, 2, 3}});
  EXPECT_FALSE(renderer.render(other, camera, view).value().truth().expected_rmse);
  const auto refused = renderer.render(other, camera, view, {.max_error = 2});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("nadir build"), std::string::npos);
  EXPECT_FALSE(renderer.render(scene, camera, view, {.max_error = -1}));
}

TEST(Forecast, OctavesHaveThePowerThatLevelsLose) {
  // A fine texture alone: the first level loses it, the others nothing
  const auto fine = ErrorModel::octave_powers(std::vector<double>{10, 0, 0});
  EXPECT_NEAR(std::sqrt(fine[0]), 10, 2);
  EXPECT_LT(fine[1] + fine[2], 0.05 * fine[0]);
  ErrorModel model;
  // Magnified, and sampled from level 0, pixels are the reference's
  EXPECT_NEAR(model.mean_square_error(fine, {.width = 0.05, .height = 0.05}), 0, 0.01);
  // A footprint of four texels averages the texture away; one sample of level 0 shows all of it
  EXPECT_GT(model.mean_square_error(fine, {.width = 4, .height = 4}), 0.2 * fine[0]);
  EXPECT_LT(model.mean_square_error(fine, {.width = 4, .height = 4, .samples_x = 8, .samples_y = 8}), 0.02 * fine[0]);
}

}  // namespace
}  // namespace nadir::render
