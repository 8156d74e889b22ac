#include "twin_headers.h"

#include <gtest/gtest.h>

#include "mosaic/raster_file.h"
#include "support/temporary_folder.h"

namespace nadir::mosaic {
namespace {

using test::TemporaryFolder;

/// Reads files in their order; whether each is told as GDAL tells it.
void expect_all_as_gdal_tells(TwinHeaders& twins, const std::vector<std::string>& paths) {
  for (const std::string& path : paths) {
    SCOPED_TRACE(path);
    const auto a = twins.read({path, path, nullptr}), g = read_header({path, path, nullptr});
    ASSERT_TRUE(a && g);
    EXPECT_EQ(a->file.path, path);
    EXPECT_EQ(a->file.bytes, g->file.bytes);
    EXPECT_EQ(a->file.changed_ns, g->file.changed_ns);
    EXPECT_EQ(a->description.path, path);
    EXPECT_EQ(a->description.acquired, g->description.acquired);
    ASSERT_TRUE(a->description.georeference && g->description.georeference);
    EXPECT_EQ(a->description.georeference->definition, g->description.georeference->definition);
    EXPECT_EQ(a->description.georeference->crs_from_texel.matrix(),
              g->description.georeference->crs_from_texel.matrix());
    EXPECT_EQ(a->description.levels.front().width, g->description.levels.front().width);
    EXPECT_EQ(a->metadata, g->metadata);
    EXPECT_EQ(a->masked, g->masked);
    ASSERT_EQ(a->bands.size(), g->bands.size());
    EXPECT_EQ(a->bands.front().nodata, g->bands.front().nodata);
    EXPECT_EQ(a->bands.front().palette, g->bands.front().palette);
    EXPECT_EQ(a->bands.front().metadata, g->bands.front().metadata);
    EXPECT_EQ(a->tiff.has_value(), g->tiff.has_value());
  }
}

RasterFile at(double x) {
  RasterFile file;
  file.place[0] = x;
  file.options = {"COMPRESS=DEFLATE"};
  return file;
}

TEST(TwinHeaders, OfFilesThatDifferByPlaceAndDateAreReadByGdalOnce) {
  const TemporaryFolder folder;
  std::vector<std::string> paths;
  for (int i = 0; i < 5; ++i) {
    RasterFile file = at(500000 + 70.125 * i);
    file.place[3] += 0.1 * i;
    file.value = [=](int, int x, int y) { return (x * y * (i + 1)) % 251; };  // other bytes, other sizes of strips
    file.metadata["TIFFTAG_DATETIME"] = "2024:05:0" + std::to_string(i + 1) + " 10:20:30";
    file.metadata["mission"] = "7";
    paths.push_back(folder.file(std::to_string(i) + ".tif"));
    write(file, paths.back());
  }
  TwinHeaders twins;
  expect_all_as_gdal_tells(twins, paths);
  EXPECT_EQ(twins.twins(), 4);
}

TEST(TwinHeaders, WhatTellsSomethingElseIsNoTwin) {
  const TemporaryFolder folder;
  std::vector<std::string> paths;
  const auto add = [&](const RasterFile& file) {
    paths.push_back(folder.file(std::to_string(paths.size()) + ".tif"));
    write(file, paths.back());
  };
  RasterFile file = at(500000);
  add(file);
  file.nodata = {0.0};
  add(file);
  file = at(500000);
  file.metadata["mission"] = "8";
  add(file);
  file = at(500000);
  file.crs = "EPSG:32615";
  add(file);
  file = at(500000);
  file.place[1] = 2;
  add(file);
  file = at(500000);
  file.width = 71;
  add(file);
  file = at(500000);
  file.mask = true;
  add(file);
  file = at(500000);
  file.metadata["AREA_OR_POINT"] = "Point";
  add(file);
  add(file);
  add(at(500000));  // and beside it a file that says more
  folder.write("9.tif.aux.xml", "<PAMDataset><Metadata><MDI key=\"mission\">9</MDI></Metadata></PAMDataset>");
  TwinHeaders twins;
  expect_all_as_gdal_tells(twins, paths);
  EXPECT_EQ(twins.twins(), 0);
}

}  // namespace
}  // namespace nadir::mosaic
