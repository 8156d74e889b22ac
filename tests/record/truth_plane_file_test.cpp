#include "nadir/record/truth_plane_file.h"

#include <gdal_priv.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "support/small_disk.h"
#include "support/temporary_folder.h"

namespace nadir::record {
namespace {

using namespace geodesy;
using render::TruthPlanes;

/// From 400 km above the curved Earth, with sky above the horizon. Neither side is a multiple of a tile's.
TruthPlanes towards_the_horizon() {
  const render::Surface surface = render::Ellipsoid(Geodetic::degrees(-30, 120, 0), 250);
  const auto camera = render::Camera::pinhole(300, 270, 250, 250, 150, 135).value();
  return truth_planes(render::ExactChain(
      camera, render::camera_pose(Geodetic::degrees(-30, 120, 400e3), YawPitchRoll::degrees(40, 75, 0)), surface));
}

std::vector<double> gdal_band(GDALDataset& file, int band) {
  std::vector<double> values(static_cast<std::size_t>(file.GetRasterXSize()) *
                             static_cast<std::size_t>(file.GetRasterYSize()));
  EXPECT_EQ(
      file.GetRasterBand(band)->RasterIO(GF_Read, 0, 0, file.GetRasterXSize(), file.GetRasterYSize(), values.data(),
                                         file.GetRasterXSize(), file.GetRasterYSize(), GDT_Float64, 0, 0, nullptr),
      CE_None);
  return values;
}

/// How many values differ; NaN is NaN.
template <class T>
std::size_t differences(const std::vector<double>& read, const std::vector<T>& expected) {
  if (read.size() != expected.size()) return std::max(read.size(), expected.size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < read.size(); ++i)
    count += !(read[i] == static_cast<double>(expected[i]) || (std::isnan(read[i]) && std::isnan(expected[i])));
  return count;
}

TEST(TruthPlaneFile, GdalReadsEveryValueAndTheNamesOfBands) {
  const test::TemporaryFolder folder;
  const TruthPlanes planes = towards_the_horizon();
  const auto sky = static_cast<std::size_t>(
      std::count_if(planes.range_m.begin(), planes.range_m.end(), [](float v) { return std::isnan(v); }));
  ASSERT_GT(sky, 1000u);
  ASSERT_LT(sky, planes.range_m.size() - 1000);
  const std::string path = folder.file("new/folder/p.truth.tif");
  ASSERT_TRUE(write_truth_planes(path, planes));

  GDALAllRegister();
  const GDALDatasetUniquePtr file(GDALDataset::Open(path.c_str()));
  ASSERT_TRUE(file);
  ASSERT_EQ(file->GetRasterCount(), 6);
  EXPECT_EQ(differences(gdal_band(*file, 1), planes.longitude_deg), 0u);
  EXPECT_EQ(differences(gdal_band(*file, 2), planes.latitude_deg), 0u);
  EXPECT_EQ(differences(gdal_band(*file, 3), planes.height_m), 0u);
  EXPECT_EQ(differences(gdal_band(*file, 4), planes.range_m), 0u);
  EXPECT_EQ(differences(gdal_band(*file, 5), planes.incidence_deg), 0u);
  EXPECT_EQ(differences(gdal_band(*file, 6), planes.ground_sample_distance_m), 0u);

  const char* const names[] = {"longitude_deg", "latitude_deg",  "height_ellipsoid_m",
                               "range_m",       "incidence_deg", "ground_sample_distance_m"};
  const char* const units[] = {"deg", "deg", "m", "m", "deg", "m"};
  for (int band = 1; band <= 6; ++band) {
    EXPECT_STREQ(file->GetRasterBand(band)->GetDescription(), names[band - 1]);
    EXPECT_STREQ(file->GetRasterBand(band)->GetUnitType(), units[band - 1]);
    EXPECT_EQ(file->GetRasterBand(band)->GetRasterDataType(), GDT_Float64);
    EXPECT_NE(file->GetRasterBand(band)->GetColorInterpretation(), GCI_AlphaBand) << "bands are data";
    int has_nodata = 0;
    EXPECT_TRUE(std::isnan(file->GetRasterBand(band)->GetNoDataValue(&has_nodata)));
    EXPECT_TRUE(has_nodata);
  }
}

TEST(TruthPlaneFile, GivesBackEveryBit) {
  const test::TemporaryFolder folder;
  for (const TruthPlanes& planes : {towards_the_horizon(), TruthPlanes(1, 1), TruthPlanes(256, 512)}) {
    const std::string path = folder.file("p.truth.tif");
    ASSERT_TRUE(write_truth_planes(path, planes));
    const auto read = read_truth_planes(path);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_TRUE(*read == planes) << planes.width << " x " << planes.height;
  }
}

TEST(TruthPlaneFile, TheSamePlanesGiveTheSameBytes) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(write_truth_planes(folder.path() / "a.tif", towards_the_horizon()));
  ASSERT_TRUE(write_truth_planes(folder.path() / "b.tif", towards_the_horizon()));
  EXPECT_EQ(test::bytes_of(folder.path() / "a.tif"), test::bytes_of(folder.path() / "b.tif"));
}

TEST(TruthPlaneFile, CutAnywhereIsAnErrorThatNamesItAndNoCrash) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(write_truth_planes(folder.path() / "whole.tif", TruthPlanes(300, 20)));
  const std::string bytes = test::bytes_of(folder.path() / "whole.tif");
  const std::string path = folder.file("cut.tif");
  constexpr std::size_t not_needed = 8;  // the last tile's trailer and up to 3 bytes of padding
  constexpr std::size_t header = 2048;   // and a little of the first tile
  for (std::size_t length = 0; length + not_needed < bytes.size(); length += length < header ? 1 : 37) {
    std::ofstream(path, std::ios::binary) << bytes.substr(0, length);
    const auto read = read_truth_planes(path);
    ASSERT_FALSE(read) << length << " of " << bytes.size() << " bytes";
    EXPECT_NE(read.error().message.find(path), std::string::npos) << read.error().message;
  }
  EXPECT_EQ(read_truth_planes(folder.path() / "missing.tif").error().kind, Error::Kind::NotFound);
}

TEST(TruthPlaneFile, AnotherTiffIsTold) {
  const test::TemporaryFolder folder;
  GDALAllRegister();
  const std::string path = folder.file("other.tif");
  GDALClose(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(path.c_str(), 20, 20, 6, GDT_Float64, nullptr));
  const auto read = read_truth_planes(path);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().message, path + ": is not a file of truth planes");
}

TEST(TruthPlaneFile, AFullDiskIsAnErrorAndLeavesNoFile) {
  const test::TemporaryFolder folder;
  const test::SmallDisk disk(4096);
  const auto written = write_truth_planes(folder.path() / "p.truth.tif", towards_the_horizon());
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().kind, Error::Kind::Io);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace nadir::record
