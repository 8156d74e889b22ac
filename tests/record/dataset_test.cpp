#include "nadir/record/dataset.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "nadir/record/image_files.h"
#include "nadir/record/scratch_dataset.h"
#include "support/scene.h"
#include "support/small_disk.h"
#include "support/temporary_folder.h"

namespace nadir::record {
namespace {

using render::Renderer, render::Scene;

class DatasetTest : public testing::Test {
 protected:
  DatasetTest() {
    test::SyntheticMap synthetic = test::utm_map(200, 1);
    synthetic.type = GDT_Byte;
    synthetic.bands = 3;
    synthetic.value = [](int, int band, int col, int row) { return (col * 3 + row * 5 + band * 70) % 256; };
    test::write_map(synthetic, folder.file("m.tif"));
    map.emplace(tile::Map::open(folder.file("m.tif")).value());
    scene.emplace(Scene::plane(map->center(), {}).with_layer("eo", *map));
  }
  /// At 200 m the whole image sees the map, at 400 m a quarter does.
  render::Frame frame(double height_m) {
    return renderer.render(*scene, test::square_camera(100, 100), test::over_centre(*map, height_m)).value();
  }

  std::vector<nlohmann::json> records() {
    std::vector<nlohmann::json> lines;
    std::istringstream text(test::bytes_of(out() / "frames.jsonl"));
    for (std::string line; std::getline(text, line);) lines.push_back(nlohmann::json::parse(line));
    return lines;
  }
  std::filesystem::path out() const { return folder.path() / "out"; }

  test::TemporaryFolder folder;
  std::optional<tile::Map> map;
  std::optional<Scene> scene;
  Renderer renderer;
};

TEST_F(DatasetTest, ListsEachFrameWithItsTruthAndTheImageHasItsPixels) {
  Dataset dataset = Dataset::create(out(), false).value();
  ASSERT_TRUE(dataset.add(frame(150), 100'000'000, "plane1", true));
  ASSERT_TRUE(dataset.add(frame(400), 200'000'000, "plane1", true));
  ASSERT_TRUE(dataset.finish());
  const auto lines = records();
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0]["file"], "frames/plane1/eo/000000100000000.png");
  EXPECT_TRUE(lines[0]["mask_file"].is_null()) << "every pixel is valid";
  EXPECT_EQ(lines[0]["checksum"], checksum(frame(150).layer()));
  EXPECT_NEAR(lines[0]["footprint"]["enu_m"][0][1].get<double>(), 75, 1e-6) << "top left is 75 m to the north";
  EXPECT_NEAR(lines[0]["image_gsd_m"].get<double>(), 1.5, 1e-9);

  const Image image = image_files().value()->read(out() / lines[0]["file"].get<std::string>()).value();
  EXPECT_EQ(image.samples, frame(150).layer().samples);
  const Image mask = image_files().value()->read(out() / lines[1]["mask_file"].get<std::string>()).value();
  EXPECT_EQ(static_cast<int>(mask.samples[50 * 100 + 50]), 255);
  EXPECT_EQ(static_cast<int>(mask.samples[0]), 0);
}

TEST_F(DatasetTest, AFrameInBandsLeavesTheFilesAndTheRecordOfTheWholeOne) {
  test::SyntheticMap heights = test::utm_map(200, 1);
  heights.value = [](int, int, int col, int row) { return col + row / 7.0; };
  test::write_map(heights, folder.file("h.tif"));
  const Scene both = scene->with_layer("height", tile::Map::open(folder.file("h.tif")).value());
  const render::Camera camera = test::square_camera(150, 150);
  for (const int rows : {64, 128, 1000}) {
    Dataset whole = Dataset::create(folder.path() / "whole", true).value();
    Dataset bands = Dataset::create(folder.path() / "bands", true).value();
    for (const double height_m : {150.0, 400.0}) {
      const auto time_ns = static_cast<std::int64_t>(height_m);
      const auto pose = test::over_centre(*map, height_m);
      ASSERT_TRUE(whole.add(renderer.render(both, camera, pose).value(), time_ns, "p", true));
      BandedFrame frame = bands.begin_bands(time_ns, "p", true).value();
      const auto sink = [&](const render::Frame& band, int) { return frame.add(band); };
      const auto made = renderer.render_bands(both, camera, pose, {}, rows, sink).value();
      ASSERT_TRUE(bands.add(std::move(frame), made));
    }
    ASSERT_TRUE(whole.finish());
    ASSERT_TRUE(bands.finish());
    int files = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder.path() / "whole" / "frames")) {
      if (!entry.is_regular_file()) continue;
      ++files;
      const auto other = folder.path() / "bands" / entry.path().lexically_relative(folder.path() / "whole");
      EXPECT_TRUE(test::bytes_of(entry.path()) == test::bytes_of(other)) << other;
    }
    EXPECT_EQ(files, 6) << "two images a frame, and the masks of one";
    const auto lines = [&](const char* name) {
      std::vector<nlohmann::json> found;
      std::istringstream text(test::bytes_of(folder.path() / name / "frames.jsonl"));
      for (std::string line; std::getline(text, line);) {
        found.push_back(nlohmann::json::parse(line));
        found.back().erase("render_ms");
      }
      return found;
    };
    EXPECT_EQ(lines("bands"), lines("whole"));
    EXPECT_EQ(test::bytes_of(folder.path() / "bands" / "footprints.geojson"),
              test::bytes_of(folder.path() / "whole" / "footprints.geojson"));
  }
}

TEST_F(DatasetTest, AFrameInBandsThatEndsEarlyLeavesNoFile) {
  Dataset dataset = Dataset::create(out(), false).value();
  {
    BandedFrame frame = dataset.begin_bands(1, "p", true).value();
    const auto sink = [&](const render::Frame& band, int first_row) -> Result<void> {
      if (first_row > 0) return fail(Error::Kind::Io, "enough");
      return frame.add(band);
    };
    EXPECT_FALSE(
        renderer.render_bands(*scene, test::square_camera(100, 100), test::over_centre(*map, 150), {}, 64, sink));
  }
  ASSERT_TRUE(dataset.finish());
  EXPECT_EQ(records().size(), 0u);
  for (const auto& entry : std::filesystem::recursive_directory_iterator(out() / "frames"))
    EXPECT_FALSE(entry.is_regular_file()) << entry.path();
}

TEST(PackedValidityTest, GivesBackItsRowsAndHoldsBitsOnlyWhereARowHasBothKinds) {
  constexpr int width = 1000;
  PackedValidity packed(width);
  std::vector<std::uint8_t> rows(3 * width, 1);
  std::fill_n(rows.begin() + width, width, std::uint8_t{0});
  packed.add(rows);
  const std::size_t uniform_bytes = packed.held_bytes();
  std::vector<std::uint8_t> mixed(width);
  for (std::size_t i = 0; i < width; ++i) mixed[i] = i % 3 == 0;
  packed.add(mixed);
  ASSERT_EQ(packed.rows(), 4u);
  for (std::size_t y = 0; y < 3; ++y) EXPECT_EQ(packed.row(y), std::vector<std::uint8_t>(width, y != 1));
  EXPECT_EQ(packed.row(3), mixed);
  EXPECT_LE(packed.held_bytes(), uniform_bytes + width / 8 + 8 + 256) << "a bit each";
}

TEST_F(DatasetTest, AFrameThatWasNotMadeIsListedWithItsReason) {
  Dataset dataset = Dataset::create(out(), false).value();
  ASSERT_TRUE(dataset.add_rejected({"eo", "sar"}, 5, "plane1", "outside"));
  ASSERT_TRUE(dataset.finish());
  ASSERT_EQ(records().size(), 2u);
  EXPECT_TRUE(records()[1]["file"].is_null());
  EXPECT_EQ(records()[1]["sensor"], "sar");
  EXPECT_EQ(records()[1]["rejected"], "outside");
}

TEST_F(DatasetTest, FootprintsAreAWholeFileAfterEachFrame) {
  const auto footprints = [&] { return nlohmann::json::parse(test::bytes_of(out() / "footprints.geojson")); };
  Dataset dataset = Dataset::create(out(), false).value();
  EXPECT_EQ(footprints(), (nlohmann::json{{"type", "FeatureCollection"}, {"features", nlohmann::json::array()}}));
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(dataset.add(frame(150), i, "v", true));
    ASSERT_TRUE(dataset.add_rejected({"eo"}, i, "v", "outside"));
    // Two are on their way at most
    EXPECT_GE(footprints()["features"].size() + 2, static_cast<std::size_t>(i));
  }
  ASSERT_TRUE(dataset.finish());
  ASSERT_EQ(footprints()["features"].size(), 5u) << "what was rejected sees nothing";
  EXPECT_EQ(records().size(), 10u);
  for (std::size_t i = 0; i < 5; ++i) {
    const auto feature = footprints()["features"][i], record = records()[2 * i];
    EXPECT_EQ(feature["geometry"], record["footprint"]["geometry"]);
    EXPECT_EQ(feature["properties"]["file"], record["file"]);
    EXPECT_EQ(feature["properties"]["time_ns"], i);
    EXPECT_EQ(feature["geometry"]["coordinates"][0].size(), 5u) << "a closed quadrangle";
  }
}

TEST_F(DatasetTest, FootprintsStayWholeOnADiskThatIsFull) {
  auto file = FeatureFile::create(folder.path() / "f.geojson").value();
  const std::string feature = R"({"type":"Feature","geometry":null,"properties":{}})";
  ASSERT_TRUE(file.add({feature}));
  const std::string before = test::bytes_of(folder.path() / "f.geojson");
  {
    const test::SmallDisk disk(before.size() + 10);
    EXPECT_EQ(file.add({feature}).error().kind, Error::Kind::Io);
  }
  EXPECT_EQ(test::bytes_of(folder.path() / "f.geojson"), before);
  ASSERT_TRUE(file.add({feature, feature}));
  EXPECT_EQ(nlohmann::json::parse(test::bytes_of(folder.path() / "f.geojson"))["features"].size(), 3u);
}

TEST_F(DatasetTest, AFullDiskIsReportedAndWhatIsListedIsWhole) {
  Dataset dataset = Dataset::create(out(), false).value();
  ASSERT_TRUE(dataset.add(frame(150), 0, "v", true));
  ASSERT_TRUE(dataset.finish());
  {
    const test::SmallDisk disk(3000);
    Result<void> written = dataset.add(frame(150), 1, "v", true);
    if (written) written = dataset.finish();
    ASSERT_FALSE(written);
    EXPECT_EQ(written.error().kind, Error::Kind::Io);
  }
  EXPECT_EQ(records().size(), 1u);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(out() / "frames/v/eo"), {}), 1)
      << "no part of the second image";
}

TEST_F(DatasetTest, ReplacesAnEarlierDatasetOnlyWhenTold) {
  {
    Dataset dataset = Dataset::create(out(), false).value();
    ASSERT_TRUE(dataset.add(frame(150), 0, "v", true));
    ASSERT_TRUE(dataset.finish());
  }
  EXPECT_EQ(Dataset::create(out(), false).error().kind, Error::Kind::Exists);
  Dataset dataset = Dataset::create(out(), true).value();
  ASSERT_TRUE(dataset.finish());
  EXPECT_TRUE(records().empty());
  EXPECT_FALSE(std::filesystem::exists(out() / "frames")) << "frames that nothing lists are gone";
}

TEST_F(DatasetTest, FloatsBecomeTiffWithNanWhereNothingIsSeen) {
  const Scene floats =
      Scene::plane(map->center(), {}).with_layer("f", *map, {.output = render::Output{tile::SampleType::Float32}});
  Dataset dataset = Dataset::create(out(), false).value();
  ASSERT_TRUE(dataset.add(renderer.render(floats, test::square_camera(100, 100), test::over_centre(*map, 400)).value(),
                          0, "v", true));
  ASSERT_TRUE(dataset.finish());
  const Image image = image_files().value()->read(out() / "frames/v/f/000000000000000.tif").value();
  const auto* samples = reinterpret_cast<const float*>(image.samples.data());
  EXPECT_TRUE(std::isnan(samples[0]));
  EXPECT_TRUE(std::isfinite(samples[3 * (50 * 100 + 50)]));
}

TEST_F(DatasetTest, FramesThatWereTriedAreWrittenAndLeaveNothing) {
  std::filesystem::create_directories(out());
  {
    ScratchDataset scratch(out());
    EXPECT_TRUE(std::filesystem::is_empty(out())) << "nothing where nothing is tried";
    for (int i = 0; i < 4; ++i) ASSERT_TRUE(scratch.add(frame(150)));
    EXPECT_EQ(test::bytes_of(out() / "tried_frames/frames/tried/eo/000000000000000.png").substr(1, 3), "PNG");
  }
  EXPECT_TRUE(std::filesystem::is_empty(out()));
  test::TemporaryFolder other;
  other.write("file", "");
  ScratchDataset nowhere(other.path() / "file");
  EXPECT_FALSE(nowhere.add(frame(150))) << "no folder can be made there";
}

}  // namespace
}  // namespace nadir::record
