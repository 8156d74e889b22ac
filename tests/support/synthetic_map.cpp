#include "support/synthetic_map.h"

#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <memory>
#include <stdexcept>

namespace nadir::test {
namespace {

void fill(GDALRasterBand& band, const std::function<double(int, int)>& value) {
  std::vector<double> row(static_cast<std::size_t>(band.GetXSize()));
  for (int y = 0; y < band.GetYSize(); ++y) {
    for (int x = 0; x < band.GetXSize(); ++x) row[static_cast<std::size_t>(x)] = value(x, y);
    if (band.RasterIO(GF_Write, 0, y, band.GetXSize(), 1, row.data(), band.GetXSize(), 1, GDT_Float64, 0, 0, nullptr) !=
        CE_None)
      throw std::runtime_error("a synthetic map cannot be written");
  }
}

}  // namespace

void write_map(const SyntheticMap& map, const std::string& path) {
  GDALAllRegister();
  CPLSetThreadLocalConfigOption("GDAL_TIFF_INTERNAL_MASK", "YES");
  const std::string tile = std::to_string(map.tile);
  const std::vector<std::string> options = {"TILED=YES", "BLOCKXSIZE=" + tile, "BLOCKYSIZE=" + tile,
                                            map.alpha ? "ALPHA=YES" : "ALPHA=NO"};
  std::vector<const char*> list;
  for (const auto& option : options) list.push_back(option.c_str());
  list.push_back(nullptr);
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
  const std::unique_ptr<GDALDataset, decltype(&GDALClose)> dataset(
      driver->Create(path.c_str(), map.width, map.height, map.bands, map.type, const_cast<char**>(list.data())),
      &GDALClose);
  if (!dataset) throw std::runtime_error(path + ": cannot be made");
  OGRSpatialReference srs;
  srs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  if (!map.crs.empty()) srs.SetFromUserInput(map.crs.c_str());
  if (!map.crs.empty() && map.control_points.empty()) dataset->SetSpatialRef(&srs);
  if (map.pixel_is_point) dataset->SetMetadataItem("AREA_OR_POINT", "Point");
  if (!map.role.empty()) dataset->SetMetadataItem("NADIR_ROLE", map.role.c_str());
  std::array<double, 6> geotransform = map.geotransform;
  if (map.control_points.empty()) {
    dataset->SetGeoTransform(geotransform.data());
  } else {
    std::vector<GDAL_GCP> points(map.control_points.size());
    GDALInitGCPs(static_cast<int>(points.size()), points.data());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto& [x, y, place_x, place_y] = map.control_points[i];
      points[i].dfGCPPixel = x, points[i].dfGCPLine = y, points[i].dfGCPX = place_x, points[i].dfGCPY = place_y;
    }
    dataset->SetGCPs(static_cast<int>(points.size()), points.data(), &srs);
    GDALDeinitGCPs(static_cast<int>(points.size()), points.data());
  }
  if (map.nodata)
    for (int b = 1; b <= map.bands; ++b) dataset->GetRasterBand(b)->SetNoDataValue(*map.nodata);
  if (map.mask) dataset->CreateMaskBand(GMF_PER_DATASET);
  std::vector<int> factors = map.factors;
  if (!factors.empty())
    dataset->BuildOverviews("NONE", static_cast<int>(factors.size()), factors.data(), 0, nullptr, nullptr, nullptr);

  for (int b = 0; b < map.bands; ++b) {
    GDALRasterBand* band = dataset->GetRasterBand(b + 1);
    fill(*band, [&](int x, int y) { return map.value(0, b, x, y); });
    for (int k = 0; k < static_cast<int>(factors.size()); ++k)
      fill(*band->GetOverview(k), [&](int x, int y) { return map.value(k + 1, b, x, y); });
  }
  if (map.mask) fill(*dataset->GetRasterBand(1)->GetMaskBand(), map.mask_value);
}

}  // namespace nadir::test
