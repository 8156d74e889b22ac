// A frame in bands is the whole frame, cut: every byte and every number of its truth.
#include <gtest/gtest.h>

#include <array>

#include "nadir/pyramid/build.h"
#include "support/scene.h"
#include "support/temporary_folder.h"

namespace nadir::render {
namespace {

/// What bands make when laid one below the other.
struct Joined {
  Frame frame;  // without pixels
  std::vector<FrameBuffer<std::byte>> samples;
  std::vector<FrameBuffer<std::uint8_t>> validity;
  std::vector<int> first_rows;
  std::size_t greatest_bytes = 0;  // of a band
};

class Bands : public testing::Test {
 protected:
  Bands() {
    test::write_map(test::busy_map(), folder.file("eo.tif"));
    test::SyntheticMap radar = test::utm_map(1024, 2);
    radar.type = GDT_Float32;
    radar.value = [](int, int, int col, int row) { return -20 + (col * 31 + row * 17) % 25; };
    test::write_map(radar, folder.file("sar.tif"));
    test::SyntheticMap labels = test::utm_map(512, 4);
    labels.type = GDT_Byte;
    labels.value = [](int, int, int col, int row) { return (col / 3 + row / 5) % 7; };
    test::write_map(labels, folder.file("labels.tif"));
    eo.emplace(tile::Map::open(folder.file("eo.tif")).value());
  }
  Scene layers(const Surface& surface) const {
    const auto map = [&](const char* name) { return tile::Map::open(folder.file(name)).value(); };
    return Scene::over(surface)
        .with_layer("eo", *eo)
        .with_layer("sar", map("sar.tif"), {.role = tile::Role::Radar})
        .with_layer("labels", map("labels.tif"), {.role = tile::Role::Labels})
        .with_layer("wide", *eo, {.bands = {2}, .output = Output{tile::SampleType::UInt16, 0, 250}});
  }
  Scene flat() const { return layers(Scene::plane(eo->center(), {}).surface()); }
  Scene curved() const { return layers(Scene::ellipsoid(eo->center(), 0).surface()); }
  CameraPose pose(double height_m, double pitch_deg) const {
    geodesy::Geodetic place = eo->center();
    place.height_m = height_m;
    return camera_pose(place, geodesy::YawPitchRoll::degrees(33, pitch_deg, 8));
  }

  template <class... View>
  static Joined joined(int rows, const View&... view) {
    Joined joined;
    Renderer renderer;
    const auto sink = [&](const Frame& band, int first_row) -> Result<void> {
      joined.first_rows.push_back(first_row);
      joined.samples.resize(band.layers().size());
      joined.validity.resize(band.layers().size());
      std::size_t bytes = 0;
      for (std::size_t i = 0; i < band.layers().size(); ++i) {
        const FrameLayer& layer = band.layers()[i];
        EXPECT_EQ(layer.validity.size(),
                  static_cast<std::size_t>(layer.width) * static_cast<std::size_t>(layer.height));
        joined.samples[i].insert(joined.samples[i].end(), layer.samples.begin(), layer.samples.end());
        joined.validity[i].insert(joined.validity[i].end(), layer.validity.begin(), layer.validity.end());
        bytes += layer.samples.size() + layer.validity.size();
      }
      joined.greatest_bytes = std::max(joined.greatest_bytes, bytes);
      return {};
    };
    joined.frame = renderer.render_bands(view..., rows, sink).value();
    return joined;
  }

  template <class... View>
  static void expect_whole(const View&... view) {
    const Frame whole = Renderer().render(view...).value();
    for (const int rows : {1, 7, 64, 100, 128, whole.layer().height, 100000}) {
      if (rows == 1 && whole.layer().height > 40) continue;  // slow, and 7 has all that it has
      SCOPED_TRACE(fmt_rows(rows));
      const Joined found = joined(rows, view...);
      std::size_t whole_bytes = 0;
      for (std::size_t i = 0; i < whole.layers().size(); ++i) {
        const FrameLayer &a = whole.layers()[i], &b = found.frame.layers()[i];
        EXPECT_TRUE(found.samples[i] == a.samples) << a.name;
        EXPECT_TRUE(found.validity[i] == a.validity) << a.name;
        whole_bytes += a.samples.size() + a.validity.size();
        EXPECT_EQ(b.width, a.width);
        EXPECT_EQ(b.height, a.height);
        EXPECT_EQ(b.type, a.type);
        EXPECT_TRUE(b.samples.empty() && b.validity.empty());
        EXPECT_EQ(b.truth.valid_fraction, a.truth.valid_fraction);
        EXPECT_EQ(b.truth.filter, a.truth.filter);
        EXPECT_EQ(b.truth.oversampling, a.truth.oversampling);
        EXPECT_EQ(b.truth.finest_level, a.truth.finest_level);
        EXPECT_EQ(b.truth.coarsest_level, a.truth.coarsest_level);
        EXPECT_EQ(b.truth.tiles, a.truth.tiles);
        EXPECT_EQ(b.truth.undersampled, a.truth.undersampled);
        EXPECT_EQ(b.truth.geometry_error_px, a.truth.geometry_error_px);
        EXPECT_EQ(b.truth.expected_rmse, a.truth.expected_rmse);
        EXPECT_EQ(b.truth.damage, a.truth.damage);
        EXPECT_EQ(b.truth.exposure.has_value(), a.truth.exposure.has_value());
      }
      if (rows < whole.layer().height) {
        EXPECT_LE(found.greatest_bytes,
                  whole_bytes * static_cast<std::size_t>(rows) / static_cast<std::size_t>(whole.layer().height));
      }
    }
  }
  static std::string fmt_rows(int rows) { return std::to_string(rows) + " rows a band"; }

  test::TemporaryFolder folder;
  std::optional<tile::Map> eo;
  const Camera camera = Camera::pinhole(300, 290, 300, 300, 150, 145).value();
};

TEST_F(Bands, HomographiesQuadraticsAndPixelsOfTheHorizonAreThoseOfTheWholeFrame) {
  for (const double pitch_deg : {0.0, 40.0, 80.0}) {
    expect_whole(flat(), camera, pose(700, pitch_deg), RenderOptions{.quality = Quality::best});
    expect_whole(curved(), camera, pose(700, pitch_deg), RenderOptions{.quality = Quality::draft});
  }
}

TEST_F(Bands, AndSoAreThoseThroughALensWithAFillValue) {
  const std::array<double, 4> barrel = {-0.3, 0.1, 0.001, -0.002};
  const Camera distorted = camera.with_lens(Lens::make(LensModel::plumb_bob, barrel).value());
  expect_whole(flat(), distorted, pose(900, 20), RenderOptions{.off_map = OffMap::Fill, .fill_value = 77});
}

TEST_F(Bands, BlurAndARollingShutterAreThoseOfTheWholeFrame) {
  CameraPose turned = pose(640, 12);
  turned.origin += Eigen::Vector3d(9, 4, 2);
  const auto motion = CameraMotion::through({{-0.1, pose(600, 10)}, {0.003, turned}, {0.1, pose(620, 14)}}).value();
  for (const Shutter& shutter : {Shutter{.exposure_s = 0.02}, Shutter{.exposure_s = 0.01, .readout_s = 0.05},
                                 Shutter{.exposure_s = 0, .readout_s = 0.05}})
    expect_whole(flat(), camera, motion, shutter, RenderOptions{});
}

TEST_F(Bands, WhatIsChosenByAnErrorIsChosenForTheWholeFrame) {
  pyramid::BuildOptions build;
  build.sources = {NADIR_SOURCE_DIR "/sim/demo/maps/kampala.tif"};
  build.output = folder.file("built.tif");
  ASSERT_TRUE(pyramid::build(build));
  const auto map = tile::Map::open(folder.file("built.tif")).value();
  const Scene scene = Scene::plane(map.center(), {}).with_layer("eo", map, {.bands = {1, 2, 3}});
  geodesy::Geodetic place = map.center();
  place.height_m = 300 * map.texel_size_m().x() * 1.7;
  const CameraPose view = camera_pose(place, geodesy::YawPitchRoll::degrees(10, 35, 0));
  for (const double max_error : {0.5, 3.0, 8.0})
    expect_whole(scene, camera, view, RenderOptions{.max_error = max_error});
  const Frame frame = Renderer().render(scene, camera, view).value();
  EXPECT_TRUE(frame.truth().expected_rmse) << "else nothing was compared";
}

TEST_F(Bands, FramesOfOnePixelOneRowAndOneColumn) {
  for (const auto& [width, height] : {std::pair(1, 1), {200, 1}, {1, 200}, {3, 2}}) {
    const Camera small = Camera::pinhole(width, height, 150, 150, width / 2.0, height / 2.0).value();
    const Frame frame = Renderer().render(flat(), small, pose(300, 5)).value();
    EXPECT_EQ(frame.layer().validity.size(), static_cast<std::size_t>(width * height));
    EXPECT_EQ(frame.truth("labels").valid_fraction, 1);
    expect_whole(flat(), small, pose(300, 5), RenderOptions{});
    expect_whole(curved(), small, pose(300, 70), RenderOptions{});
  }
}

TEST_F(Bands, RowsComeFromTheTopAndWhatTheSinkSaysEndsTheFrame) {
  EXPECT_EQ(joined(100, flat(), camera, pose(300, 0), RenderOptions{}).first_rows, (std::vector{0, 100, 200}));
  int bands = 0;
  const auto full =
      Renderer().render_bands(flat(), camera, pose(300, 0), {}, 64, [&](const Frame&, int) -> Result<void> {
        ++bands;
        return fail(Error::Kind::Io, "the disk is full");
      });
  ASSERT_FALSE(full);
  EXPECT_EQ(full.error().message, "the disk is full");
  EXPECT_EQ(bands, 1);
  const auto never = [](const Frame&, int) -> Result<void> {
    ADD_FAILURE() << "no band can be made";
    return {};
  };
  EXPECT_EQ(Renderer().render_bands(flat(), camera, pose(300, 0), {}, 0, never).error().kind, Error::Kind::Malformed);
  EXPECT_EQ(Renderer().render_bands(flat(), camera, pose(300, 0), {.allow_coarse = true}, 64, never).error().kind,
            Error::Kind::Unsupported);
  EXPECT_EQ(
      Renderer().render_bands(flat(), camera, pose(300000, 0), {.off_map = OffMap::Reject}, 64, never).error().kind,
      Error::Kind::OutsideMap);
}

}  // namespace
}  // namespace nadir::render
