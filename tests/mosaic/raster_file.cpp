#include "mosaic/raster_file.h"

#include <gtest/gtest.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "nadir/gdal/dataset.h"

namespace nadir::mosaic {
namespace {

void fill(GDALRasterBand& band, const std::function<double(int, int)>& value) {
  std::vector<double> row(static_cast<std::size_t>(band.GetXSize()));
  for (int y = 0; y < band.GetYSize(); ++y) {
    for (int x = 0; x < band.GetXSize(); ++x) row[static_cast<std::size_t>(x)] = value(x, y);
    if (band.RasterIO(GF_Write, 0, y, band.GetXSize(), 1, row.data(), band.GetXSize(), 1, GDT_Float64, 0, 0, nullptr) !=
        CE_None)
      throw std::runtime_error("a raster of a test cannot be written");
  }
}

}  // namespace

void write(const RasterFile& file, const std::string& path) {
  GDALAllRegister();
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName(file.driver.c_str());
  if (!driver) throw std::runtime_error("no driver " + file.driver);
  const bool copies = !driver->GetMetadataItem(GDAL_DCAP_CREATE);  // a format that is written whole
  std::vector<const char*> options;
  for (const auto& option : file.options) options.push_back(option.c_str());
  options.push_back(nullptr);
  char** list = const_cast<char**>(options.data());
  GDALDriver* first = copies ? GetGDALDriverManager()->GetDriverByName("MEM") : driver;
  std::unique_ptr<GDALDataset> dataset(
      first->Create(path.c_str(), file.width, file.height, file.bands, file.type, copies ? nullptr : list));
  if (!dataset) throw std::runtime_error(path + ": cannot be made");
  if (!file.crs.empty()) {
    OGRSpatialReference srs;
    srs.SetFromUserInput(file.crs.c_str());
    srs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    dataset->SetSpatialRef(&srs);
    std::array<double, 6> place = file.place;
    dataset->SetGeoTransform(place.data());
  }
  for (const auto& [key, value] : file.metadata) dataset->SetMetadataItem(key.c_str(), value.c_str());
  for (int b = 1; b <= file.bands; ++b) {
    const auto at = static_cast<std::size_t>(b) - 1;
    GDALRasterBand* band = dataset->GetRasterBand(b);
    if (at < file.colors.size()) band->SetColorInterpretation(file.colors[at]);
    if (at < file.names.size()) band->SetDescription(file.names[at].c_str());
    if (at < file.nodata.size() && file.nodata[at]) band->SetNoDataValue(*file.nodata[at]);
  }
  if (!file.palette.empty()) {
    GDALColorTable table;
    for (int i = 0; i < static_cast<int>(file.palette.size()); ++i) {
      const auto& c = file.palette[static_cast<std::size_t>(i)];
      const GDALColorEntry entry{c[0], c[1], c[2], c[3]};
      table.SetColorEntry(i, &entry);
    }
    dataset->GetRasterBand(1)->SetColorTable(&table);
  }
  if (file.mask) {
    CPLSetThreadLocalConfigOption("GDAL_TIFF_INTERNAL_MASK", file.external_mask ? "NO" : "YES");
    dataset->CreateMaskBand(GMF_PER_DATASET);
  }
  if (!file.unwritten)
    for (int b = 0; b < file.bands; ++b)
      fill(*dataset->GetRasterBand(b + 1), [&](int x, int y) { return file.value(b, x, y); });
  if (file.mask)
    fill(*dataset->GetRasterBand(1)->GetMaskBand(), [](int x, int y) { return (x / 8 + y / 4) % 3 == 0 ? 0 : 255; });
  if (!copies) return;
  std::unique_ptr<GDALDataset> copy(driver->CreateCopy(path.c_str(), dataset.get(), FALSE, list, nullptr, nullptr));
  if (!copy) throw std::runtime_error(path + ": cannot be made");
}

GdalTexels read_by_gdal(const std::string& path, const Window& w, const std::vector<int>& bands) {
  GDALAllRegister();
  const gdal::GdalMessages unprinted;
  const std::unique_ptr<GDALDataset> dataset(GDALDataset::Open(path.c_str()));
  if (!dataset) throw std::runtime_error(path + ": cannot be opened");
  const std::size_t texels = static_cast<std::size_t>(w.width) * static_cast<std::size_t>(w.height);
  GdalTexels read;
  read.samples.resize(texels * bands.size());
  read.valid.assign(texels, 255);
  for (std::size_t b = 0; b < bands.size(); ++b) {
    std::vector<double> samples(texels);
    std::vector<std::uint8_t> mask(texels);
    GDALRasterBand* band = dataset->GetRasterBand(bands[b]);
    if (band->RasterIO(GF_Read, w.x, w.y, w.width, w.height, samples.data(), w.width, w.height, GDT_Float64, 0, 0,
                       nullptr) != CE_None ||
        band->GetMaskBand()->RasterIO(GF_Read, w.x, w.y, w.width, w.height, mask.data(), w.width, w.height, GDT_Byte, 0,
                                      0, nullptr) != CE_None)
      throw std::runtime_error(path + ": cannot be read");
    for (std::size_t i = 0; i < texels; ++i) {
      read.samples[i * bands.size() + b] = samples[i];
      if (mask[i] < 128) read.valid[i] = 0;
    }
  }
  return read;
}

std::vector<double> samples_of(const Block& block, const TexelType& type) {
  std::vector<double> samples;
  tiff::with_sample(type.sample, [&]<class T>(T) {
    const T* first = reinterpret_cast<const T*>(block.row(block.window().y));
    samples.assign(first, first + block.texels() * static_cast<std::size_t>(type.bands));
  });
  return samples;
}

std::vector<std::uint8_t> validity_of(const Block& block) {
  const std::uint8_t* first = block.valid_row(block.window().y);
  return {first, first + block.texels()};
}

testing::AssertionResult same_samples(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() != b.size()) return testing::AssertionFailure() << a.size() << " samples, not " << b.size();
  for (std::size_t i = 0; i < a.size(); ++i)
    if (a[i] != b[i] && !(std::isnan(a[i]) && std::isnan(b[i])))
      return testing::AssertionFailure() << "sample " << i << " is " << a[i] << ", not " << b[i];
  return testing::AssertionSuccess();
}

std::vector<Window> windows_of(std::int64_t width, std::int64_t height) {
  const auto w = static_cast<std::int32_t>(width), h = static_cast<std::int32_t>(height);
  std::vector<Window> windows = {{0, 0, w, h}, {w - 1, h - 1, 1, 1}};
  if (w > 40 && h > 40) {
    windows.push_back({5, 7, 30, 31});       // inside
    windows.push_back({0, 3, w, h - 5});     // whole rows
    windows.push_back({w - 33, 0, 33, h});   // whole columns
    windows.push_back({13, 17, w - 13, 9});  // to the right edge
  }
  return windows;
}

}  // namespace nadir::mosaic
