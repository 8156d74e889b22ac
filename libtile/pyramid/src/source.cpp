#include "source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "nadir/gdal/dataset.h"
#include "nadir/gdal/describe.h"
#include "tile_folder.h"

namespace nadir::pyramid {
namespace fs = std::filesystem;
namespace {

Result<Source> open_source(const std::string& name, std::optional<int> zoom) {
  Source source{name, name, {}, GDT_Unknown, {}, false, nullptr};
  std::error_code error;
  if (fs::is_directory(name, error)) {
    const auto xml = virtual_raster_of_tiles(name, zoom);
    if (!xml) return fail(xml);
    source.memory = std::make_shared<const MemoryFile>(*xml);
    source.path = source.memory->path();
  } else if (fs::exists(name, error)) {
    source.path = fs::absolute(name, error).string();  // a virtual raster would look for it beside itself
  }

  auto dataset = gdal::open_raster(source.path);
  if (!dataset) return fail(dataset.error().kind, dataset.error().message);
  const gdal::GdalMessages messages;
  std::vector<int> unused_overviews;
  source.description = gdal::describe_dataset(**dataset, name, unused_overviews);
  if (!source.description.georeference)
    return fail(Error::Kind::Malformed, fmt::format("{}: expected a georeferenced raster, found {}", name,
                                                    source.description.georeference_problem));
  return source;
}

/// Sets which bands to take, and checks that one file can hold them.
Result<void> choose_bands(Source& source, std::vector<int> numbers) {
  const auto& bands = source.description.bands;
  for (std::size_t i = 0; i < bands.size(); ++i) {
    if (bands[i].color != "Alpha") continue;
    std::erase(numbers, static_cast<int>(i) + 1);
    source.alpha = true;
    numbers.push_back(static_cast<int>(i) + 1);
  }
  if (std::count_if(bands.begin(), bands.end(), [](const tile::Band& b) { return b.color == "Alpha"; }) > 1)
    return fail(Error::Kind::Unsupported, fmt::format("{}: expected one alpha band at most, found more", source.label));

  const tile::Band& first = bands[static_cast<std::size_t>(numbers.front()) - 1];
  for (const int number : numbers) {
    const tile::Band& band = bands[static_cast<std::size_t>(number) - 1];
    if (!band.sample_type)
      return fail(Error::Kind::Unsupported,
                  fmt::format("{}: band {} {}", source.label, number, band.why_not_rendered()));
    if (band.stored_type != first.stored_type)
      return fail(Error::Kind::Unsupported,
                  fmt::format("{}: band {} has type {} and band {} has type {}, and one map holds one type; choose "
                              "among them with --bands",
                              source.label, numbers.front(), first.stored_type, number, band.stored_type));
    const bool same_nodata = band.nodata == first.nodata ||
                             (band.nodata && first.nodata && std::isnan(*band.nodata) && std::isnan(*first.nodata));
    if (band.color != "Alpha" && !same_nodata)
      return fail(Error::Kind::Unsupported, fmt::format("{}: bands {} and {} have different nodata values, and a "
                                                        "GeoTIFF holds one; choose among them with --bands, "
                                                        "or make them agree with gdal_translate -a_nodata",
                                                        source.label, numbers.front(), number));
  }
  source.bands = std::move(numbers);
  source.type = GDALGetDataTypeByName(first.stored_type.c_str());
  return {};
}

/// A mosaic keeps texels as they are: one CRS, one texel size, the same bands.
Result<void> check_agreement(const Source& first, const Source& other) {
  const auto refuse = [&](const std::string& what) {
    return fail(Error::Kind::Unsupported, fmt::format("{}: {}; a mosaic needs sources that agree with the first, {}",
                                                      other.label, what, first.label));
  };
  OGRSpatialReference a, b;
  a.SetFromUserInput(first.description.georeference->definition.c_str());
  b.SetFromUserInput(other.description.georeference->definition.c_str());
  if (!a.IsSame(&b))
    return refuse(fmt::format("its CRS is {}, not {}: bring it there with gdalwarp -t_srs",
                              other.description.georeference->crs, first.description.georeference->crs));
  if (other.description.bands.size() != first.description.bands.size() || other.alpha != first.alpha ||
      other.bands != first.bands)
    return refuse(fmt::format("it has {} bands{}, not {}{}", other.description.bands.size(),
                              other.alpha ? " with alpha" : "", first.description.bands.size(),
                              first.alpha ? " with alpha" : ""));
  if (other.type != first.type)
    return refuse(
        fmt::format("its type is {}, not {}", GDALGetDataTypeName(other.type), GDALGetDataTypeName(first.type)));

  // A hundredth of a texel over the whole width is drift nobody sees.
  const Eigen::Matrix2d step = first.description.georeference->crs_from_texel.linear();
  const Eigen::Matrix2d relative =
      step.inverse() * other.description.georeference->crs_from_texel.linear() - Eigen::Matrix2d::Identity();
  const tile::Level& size = other.description.levels.front();
  if (!(relative.cwiseAbs().maxCoeff() * std::max(size.width, size.height) < 0.01))
    return refuse("its texels have another size or direction: bring it onto that grid with gdalwarp -tr and -tap");
  return {};
}

}  // namespace

Result<std::vector<Source>> open_sources(const std::vector<std::string>& names, const std::vector<std::string>& bands,
                                         std::optional<int> zoom) {
  std::vector<Source> sources;
  std::vector<int> chosen;
  for (const std::string& name : names) {
    auto source = open_source(name, zoom);
    if (!source) return fail(source);
    if (sources.empty()) {
      for (const std::string& band : bands) {
        const auto number = source->description.find_band(band);
        if (!number) return fail(number);
        chosen.push_back(*number);
      }
    }
    std::vector<int> numbers = chosen;
    if (numbers.empty())
      for (int b = 1; b <= static_cast<int>(source->description.bands.size()); ++b) numbers.push_back(b);
    for (const int number : numbers)
      if (number > static_cast<int>(source->description.bands.size()))
        return fail(Error::Kind::NotFound, fmt::format("{}: no band {}: it has bands 1 to {}", name, number,
                                                       source->description.bands.size()));
    if (const auto ok = choose_bands(*source, std::move(numbers)); !ok) return fail(ok);
    if (!sources.empty())
      if (const auto ok = check_agreement(sources.front(), *source); !ok) return fail(ok);
    sources.push_back(std::move(*source));
  }
  return sources;
}

}  // namespace nadir::pyramid
