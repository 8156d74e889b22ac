#include "nadir/gdal/describe.h"

#include <fmt/format.h>
#include <ogr_spatialref.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "nadir/base/text.h"
#include "nadir/gdal/dataset.h"
#include "nadir/tile/raster.h"

namespace nadir::gdal {
using tile::Band, tile::Georeference, tile::Level, tile::MapDescription, tile::SampleType, tile::ValiditySource;
namespace {

std::string metadata(GDALMajorObject& object, const char* key, const char* domain = nullptr) {
  const char* value = object.GetMetadataItem(key, domain);
  return value ? value : "";
}

std::string first_metadata(GDALDataset& dataset, std::initializer_list<const char*> keys) {
  for (const char* key : keys)
    if (auto value = metadata(dataset, key); !value.empty()) return value;
  return {};
}

/// Before version 3.7 GDAL hands out signed bytes as unsigned ones, with a note.
bool holds_signed_bytes_as_unsigned(GDALRasterBand& band) {
  return metadata(band, "PIXELTYPE", "IMAGE_STRUCTURE") == "SIGNEDBYTE";
}

std::optional<SampleType> sample_type_of_band(GDALRasterBand& band) {
  const GDALDataType type = band.GetRasterDataType();
  if (GDALDataTypeIsComplex(type) || holds_signed_bytes_as_unsigned(band)) return std::nullopt;
  switch (type) {
    case GDT_Byte:
      return SampleType::UInt8;
    case GDT_UInt16:
      return SampleType::UInt16;
    case GDT_Int16:
      return SampleType::Int16;
    default:
      break;
  }
  return std::string_view(GDALGetDataTypeName(type)) == "Int8" ? SampleType::Int16 : SampleType::Float32;
}

std::optional<double> nodata_of_band(GDALRasterBand& band) {
  int there = 0;
  double value = 0;
  switch (band.GetRasterDataType()) {
    case GDT_Int64:
      value = static_cast<double>(band.GetNoDataValueAsInt64(&there));
      break;
    case GDT_UInt64:
      value = static_cast<double>(band.GetNoDataValueAsUInt64(&there));
      break;
    default:
      value = band.GetNoDataValue(&there);
  }
  return there ? std::optional(value) : std::nullopt;
}

Band describe_band(GDALRasterBand& band) {
  Band b;
  b.name = band.GetDescription();
  b.stored_type = holds_signed_bytes_as_unsigned(band) ? "Int8" : GDALGetDataTypeName(band.GetRasterDataType());
  b.sample_type = sample_type_of_band(band);
  b.nodata = nodata_of_band(band);
  b.color = GDALGetColorInterpretationName(band.GetColorInterpretation());
  b.unit = band.GetUnitType();
  b.scale = band.GetScale();
  b.offset = band.GetOffset();
  return b;
}

/// Levels of the first band; those that do not shrink both axes alike are left out, with a warning.
std::vector<Level> describe_levels(GDALDataset& dataset, std::vector<int>& overview_of_level,
                                   std::vector<std::string>& warnings) {
  GDALRasterBand& band = *dataset.GetRasterBand(1);
  Level full{band.GetXSize(), band.GetYSize()};
  band.GetBlockSize(&full.tile_width, &full.tile_height);
  std::vector<std::pair<Level, int>> found;
  for (int i = 0; i < band.GetOverviewCount(); ++i) {
    GDALRasterBand* overview = band.GetOverview(i);
    if (!overview) continue;
    Level level{overview->GetXSize(), overview->GetYSize()};
    level.texels_x = static_cast<double>(full.width) / level.width;
    level.texels_y = static_cast<double>(full.height) / level.height;
    overview->GetBlockSize(&level.tile_width, &level.tile_height);

    const bool every_band = [&] {
      for (int b = 2; b <= dataset.GetRasterCount(); ++b) {
        GDALRasterBand* other = dataset.GetRasterBand(b)->GetOverview(i);
        if (!other || other->GetXSize() != level.width || other->GetYSize() != level.height) return false;
      }
      return true;
    }();
    if (!tile::level_belongs(level, full) || !every_band) {
      warnings.push_back(fmt::format("overview {} of {} x {} does not belong to this raster and is not used", i,
                                     level.width, level.height));
      continue;
    }
    found.emplace_back(level, i);
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first.width > b.first.width; });

  std::vector<Level> levels = {full};
  for (const auto& [level, index] : found) {
    if (level.width == levels.back().width && level.height == levels.back().height) continue;
    levels.push_back(level);
    overview_of_level.push_back(index);
  }
  return levels;
}

ValiditySource describe_validity(GDALDataset& dataset) {
  const int flags = dataset.GetRasterBand(1)->GetMaskFlags();
  if (flags & GMF_ALPHA) return ValiditySource::Alpha;
  if (flags & GMF_PER_DATASET) return ValiditySource::Mask;
  if (flags & GMF_NODATA) return ValiditySource::Nodata;
  return flags & GMF_ALL_VALID ? ValiditySource::None
                               : ValiditySource::Mask;  // no flag: each band has a mask of its own
}

/// The grid on which all ground control points lie within 0.1 texels, where there is one; fewer than four lie on any.
std::optional<Eigen::Affine2d> grid_through(const GDAL_GCP* points, int count) {
  constexpr double tolerance_texels = 0.1;
  if (count < 4) return std::nullopt;
  // Both sides about their means, for the digits' sake
  Eigen::MatrixX2d texels(count, 2), crs(count, 2);
  for (int i = 0; i < count; ++i) {
    texels.row(i) << points[i].dfGCPPixel, points[i].dfGCPLine;
    crs.row(i) << points[i].dfGCPX, points[i].dfGCPY;
  }
  const Eigen::RowVector2d texel = texels.colwise().mean(), place = crs.colwise().mean();
  texels.rowwise() -= texel;
  crs.rowwise() -= place;
  const Eigen::ColPivHouseholderQR<Eigen::MatrixX2d> least_squares(texels);
  if (least_squares.rank() < 2) return std::nullopt;  // on a line
  const Eigen::Matrix2d linear = least_squares.solve(crs).transpose();
  const Eigen::MatrixX2d beside = crs * linear.inverse().transpose() - texels;
  if (!beside.allFinite() || beside.rowwise().norm().maxCoeff() > tolerance_texels) return std::nullopt;
  Eigen::Affine2d crs_from_texel = Eigen::Affine2d::Identity();
  crs_from_texel.linear() = linear;
  crs_from_texel.translation() = place.transpose() - linear * texel.transpose();
  return crs_from_texel;
}

Georeference georeference_in(const OGRSpatialReference& crs, const Eigen::Affine2d& crs_from_texel) {
  Georeference where;
  where.crs_from_texel = crs_from_texel;
  char* wkt = nullptr;
  const char* const options[] = {"FORMAT=WKT2_2019", nullptr};
  crs.exportToWkt(&wkt, options);
  where.definition = wkt ? wkt : "";
  CPLFree(wkt);
  const char *authority = crs.GetAuthorityName(nullptr), *code = crs.GetAuthorityCode(nullptr);
  where.crs = authority && code ? fmt::format("{}:{}", authority, code) : crs.GetName() ? crs.GetName() : "unnamed";
  return where;
}

/// Empty, and why, where the raster cannot be placed on the Earth.
std::optional<Georeference> describe_georeference(GDALDataset& dataset, std::string& problem) {
  double g[6];
  const bool placed = dataset.GetGeoTransform(g) == CE_None;
  const OGRSpatialReference* crs = dataset.GetSpatialRef();
  if (!placed || !crs) {
    const int control_points = dataset.GetGCPCount();
    const OGRSpatialReference* crs_of_points = dataset.GetGCPSpatialRef();
    if (control_points > 0 && !placed && crs_of_points)
      if (const auto grid = grid_through(dataset.GetGCPs(), control_points))
        return georeference_in(*crs_of_points, *grid);
    const bool rational = dataset.GetMetadata("RPC") != nullptr;
    problem = control_points > 0 ? "only ground control points, not four or more that all lie on one grid: warp it "
                                   "with gdalwarp -t_srs CRS first"
              : rational         ? "only rational polynomial coefficients: warp it with gdalwarp -rpc first"
              : placed           ? "no coordinate reference system: assign one with gdal_edit.py -a_srs"
                       : "no geotransform: assign one with gdal_edit.py -a_srs CRS -a_ullr LEFT TOP RIGHT BOTTOM";
    return std::nullopt;
  }
  Eigen::Affine2d crs_from_texel;
  crs_from_texel.matrix() << g[1], g[2], g[0], g[4], g[5], g[3], 0, 0, 1;
  const double determinant = crs_from_texel.linear().determinant();
  if (!std::all_of(g, g + 6, [](double v) { return std::isfinite(v); }) || !(std::abs(determinant) > 1e-300)) {
    problem = "its geotransform has no area";
    return std::nullopt;
  }
  return georeference_in(*crs, crs_from_texel);
}

}  // namespace

MapDescription describe_dataset(GDALDataset& dataset, const std::string& path, std::vector<int>& overview_of_level) {
  MapDescription map;
  map.path = path;
  map.format = dataset.GetDriver() ? dataset.GetDriver()->GetDescription() : "";
  map.layout = metadata(dataset, "LAYOUT", "IMAGE_STRUCTURE");
  map.compression = metadata(dataset, "COMPRESSION", "IMAGE_STRUCTURE");
  for (int b = 1; b <= dataset.GetRasterCount(); ++b) map.bands.push_back(describe_band(*dataset.GetRasterBand(b)));
  map.levels = describe_levels(dataset, overview_of_level, map.warnings);
  map.validity = describe_validity(dataset);
  map.georeference = describe_georeference(dataset, map.georeference_problem);
  map.acquired = first_metadata(dataset, {"NADIR_ACQUIRED", "ACQUISITIONDATETIME", "TIFFTAG_DATETIME"});
  map.attribution = first_metadata(dataset, {"NADIR_ATTRIBUTION", "TIFFTAG_COPYRIGHT"});
  map.licence = first_metadata(dataset, {"NADIR_LICENCE"});
  map.role = first_metadata(dataset, {"NADIR_ROLE"});
  tile::add_warnings(map);
  return map;
}

}  // namespace nadir::gdal
