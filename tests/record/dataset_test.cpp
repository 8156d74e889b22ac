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
