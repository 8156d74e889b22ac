#include "nadir/pyramid/check.h"

#include <fmt/format.h>
#include <gdal_priv.h>

#include <charconv>
#include <chrono>
#include <filesystem>

#include "check_levels.h"
#include "check_structure.h"
#include "choices.h"
#include "nadir/gdal/dataset.h"
#include "nadir/tile/map.h"

namespace nadir::pyramid {
namespace {

/// An item that `nadir build` left in the map; empty where it did not.
std::string item_of(const std::string& map, const char* name) {
  const auto dataset = gdal::open_raster(map);
  const char* value = dataset ? (*dataset)->GetMetadataItem(name) : nullptr;
  return value ? value : "";
}

std::optional<Reduction> parse_reduction(const std::string& text, const mosaic::Sources& sources) {
  constexpr std::string_view of_power = " of power";
  Reduction reduction;
  reduction.power = text.ends_with(of_power);
  const auto filter = parse_filter(text.substr(0, text.size() - (reduction.power ? of_power.size() : 0)));
  if (!filter) return std::nullopt;
  reduction.filter = *filter;
  for (int b = 0; reduction.power && b < sources.type.data_bands(); ++b) {
    reduction.scale.push_back(sources.bands[static_cast<std::size_t>(b)].scale);
    reduction.offset.push_back(sources.bands[static_cast<std::size_t>(b)].offset);
  }
  return reduction;
}

double number(const std::string& text) {
  double value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

bool is_broken_tiff(const Error& error, const mosaic::Source& source) {
  return error.kind == Error::Kind::Malformed && source.description().format == "GTiff";
}

/// More texels than the best of packings could leave of anything.
bool claims_too_much(const mosaic::Source& source, const std::string& path) {
  constexpr double most_texels_a_byte = 2e4;
  std::error_code error;
  const auto bytes = std::filesystem::file_size(path, error);
  return !error && static_cast<double>(source.width()) * static_cast<double>(source.height()) >
                       most_texels_a_byte * (static_cast<double>(bytes) + 1);
}

Result<std::shared_ptr<const tiff::TiffFile>> open_tiff(const std::string& path) {
  auto bytes = LocalFile::open(path);
  if (!bytes) return fail(bytes);
  return tiff::TiffFile::open(std::move(*bytes));
}

}  // namespace

Result<CheckReport> check(const CheckOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  const gdal::QuietGdal quiet;
  auto sources = mosaic::open_sources({.names = {options.map}, .cache_bytes = options.memory_bytes});
  if (!sources) return fail(sources);
  if (sources->rasters.size() != 1)
    return fail(Error::Kind::Unsupported, fmt::format("{}: is more than one map: check them one by one", options.map));
  CheckReport report;
  FaultList faults;
  LevelsToCheck levels;
  levels.sources = sources->overviews.front();
  levels.sources.insert(levels.sources.begin(), sources->rasters.front());
  levels.type = sources->type;
  if (const auto map = tile::Map::open(options.map); !map) faults.add(map.error().message);

  const auto tiff = open_tiff(options.map);
  if (tiff) {
    levels.tiff = *tiff;
    levels.directories = check_structure(**tiff, report, faults);
  } else if (is_broken_tiff(tiff.error(), *levels.sources.front())) {
    faults.add(tiff.error().message + ": fetch or build it again");
  } else {
    report.notes.push_back(fmt::format("structure not looked at: {}", tiff.error().message));
  }
  if (report.levels.size() != levels.sources.size()) {
    if (tiff)
      report.notes.push_back(fmt::format("of its {} levels {} can be read on their own: the others are not looked at",
                                         report.levels.size(), levels.sources.size()));
    levels.tiff.reset();
    report.levels.resize(levels.sources.size());
    for (std::size_t k = 0; k < levels.sources.size(); ++k)
      report.levels[k].size = {static_cast<std::int32_t>(levels.sources[k]->width()),
                               static_cast<std::int32_t>(levels.sources[k]->height())};
  }
  if (!tiff && is_broken_tiff(tiff.error(), *levels.sources.front())) {
    report.notes.push_back("no tile decoded: where they lie is not known");
  } else if (!levels.tiff && claims_too_much(*levels.sources.front(), options.map)) {
    faults.add(fmt::format("{}: {} x {} texels cannot lie in a file that small: it is damaged, or empty", options.map,
                           levels.sources.front()->width(), levels.sources.front()->height()));
  } else {
    report.reduction = item_of(options.map, "NADIR_REDUCTION");
    if (tiff) levels.reduction = parse_reduction(report.reduction, *sources);
    if (levels.reduction) {
      levels.bound = level_bound((*tiff)->directories().front().format, number(item_of(options.map, "NADIR_MAX_ERROR")),
                                 levels.type, *levels.reduction);
      report.bound = describe(levels.bound);
    } else if (levels.sources.size() > 1) {
      report.notes.push_back("it does not name the filter that made its levels: they are not compared");
    }
    check_levels(levels, options, report, faults);
  }
  report.fault_count = faults.count();
  report.faults = faults.first();
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return report;
}

}  // namespace nadir::pyramid
