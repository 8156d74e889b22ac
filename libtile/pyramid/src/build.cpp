#include "nadir/pyramid/build.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "codec.h"
#include "mosaic.h"
#include "nadir/base/files.h"
#include "nadir/base/progress.h"
#include "nadir/gdal/dataset.h"
#include "nadir/gdal/describe.h"
#include "nadir/tile/map.h"
#include "reduce.h"
#include "scratch.h"
#include "source.h"

namespace nadir::pyramid {
namespace fs = std::filesystem;
namespace {

/// GDAL's compression threads have no handler of their own and would print; what fails there fails in this thread too.
class QuietWorkers {
 public:
  QuietWorkers() : before_(CPLSetErrorHandler(CPLQuietErrorHandler)) {}
  ~QuietWorkers() { CPLSetErrorHandler(before_); }
  QuietWorkers(const QuietWorkers&) = delete;
  QuietWorkers& operator=(const QuietWorkers&) = delete;

 private:
  CPLErrorHandler before_;
};

/// Turns GDAL's 0 to 1 into steps of a progress bar.
class GdalProgress {
 public:
  explicit GdalProgress(bool enabled) : progress_("writing", "per mille", steps, enabled) {}

  static int CPL_STDCALL report(double done, const char*, void* self) {
    auto& p = *static_cast<GdalProgress*>(self);
    const auto now = static_cast<std::int64_t>(std::clamp(done, 0.0, 1.0) * steps);
    if (now > p.done_) p.progress_.advance(now - p.done_);
    p.done_ = std::max(p.done_, now);
    return TRUE;
  }

 private:
  static constexpr std::int64_t steps = 1000;
  Progress progress_;
  std::int64_t done_ = 0;
};

/// "2014", "2014-07", "2014-07-20" or "2014-07-20T17:05:00Z".
bool is_date(std::string_view text) {
  static constexpr std::string_view shape = "0000-00-00T00:00:00Z";
  if (text.size() != 4 && text.size() != 7 && text.size() != 10 && text.size() != 20) return false;
  for (std::size_t i = 0; i < text.size(); ++i)
    if (shape[i] == '0' ? text[i] < '0' || text[i] > '9' : text[i] != shape[i]) return false;
  const auto two_digits = [&](std::size_t at) {
    return text.size() > at ? (text[at] - '0') * 10 + text[at + 1] - '0' : 1;
  };
  return two_digits(5) >= 1 && two_digits(5) <= 12 && two_digits(8) >= 1 && two_digits(8) <= 31;
}

Result<void> check(const BuildOptions& options) {
  if (options.sources.empty()) return fail(Error::Kind::NotFound, "no source: name a raster, or a folder of map tiles");
  if (options.output.filename().empty() || options.output.string().starts_with("/vsi"))
    return fail(Error::Kind::Unsupported,
                fmt::format("{}: expected the name of a file on disk to write", options.output.string()));
  if (options.tile_size < 128 || options.tile_size > 4096 || options.tile_size % 16 != 0)
    return fail(Error::Kind::Unsupported,
                fmt::format("tile size {}: expected a multiple of 16 from 128 to 4096", options.tile_size));
  if (!options.acquired.empty() && !is_date(options.acquired))
    return fail(
        Error::Kind::Malformed,
        fmt::format("acquired '{}': expected a date such as 2014-07-20 or 2014-07-20T17:05:00Z", options.acquired));
  std::error_code error;
  if (fs::is_directory(options.output, error))
    return fail(Error::Kind::Exists,
                fmt::format("{}: is a folder; name a file, such as map.tif in it", options.output.string()));
  return refuse_to_overwrite(options.output, options.force);
}

/// The role asked for, else the one that all sources state.
std::optional<tile::Role> role_of(const BuildOptions& options, const std::vector<Source>& sources) {
  if (options.role) return options.role;
  const std::string& stated = sources.front().description.role;
  for (const Source& source : sources)
    if (source.description.role != stated) return std::nullopt;
  const auto role = tile::parse_role(stated);
  return role ? std::optional(*role) : std::nullopt;
}

void set_metadata(Mosaic& mosaic, const std::string& key, std::string_view value) {
  if (value.empty()) return;
  std::erase_if(mosaic.metadata, [&](const auto& item) { return item.first == key; });
  mosaic.metadata.emplace_back(key, value);
}

enum class Reduction { Mean, MeanOfPower, Mode };

std::string_view to_string(Reduction reduction) {
  static constexpr std::array<std::string_view, 3> names = {"mean", "mean of power", "mode"};
  return names[static_cast<std::size_t>(reduction)];
}

Reduction choose_reduction(std::optional<tile::Role> role, std::optional<tile::RadarScale> scale, Mosaic& mosaic) {
  const tile::Band& band =
      mosaic.sources.front().description.bands[static_cast<std::size_t>(mosaic.sources.front().bands.front()) - 1];
  if (role == tile::Role::Labels) return Reduction::Mode;
  if (band.color == "Palette") {
    mosaic.warnings.push_back(
        fmt::format("{} holds palette indices, which are never blended: give it role labels, or expand it with "
                    "gdal_translate -expand rgb",
                    mosaic.sources.front().label));
    return Reduction::Mode;
  }
  if (role != tile::Role::Radar) return Reduction::Mean;
  const bool floating = GDALDataTypeIsFloating(mosaic.sources.front().type);
  return scale.value_or(tile::usual_radar_scale(floating)) == tile::RadarScale::Decibel ? Reduction::MeanOfPower
                                                                                        : Reduction::Mean;
}

/// Writes `mosaic` with GDAL's COG driver. `levels`: already reduced, or empty, and the driver reduces.
Result<void> write_map(const Mosaic& mosaic, const std::vector<fs::path>& levels, Reduction reduction,
                       CPLStringList creation, const BuildOptions& options, const fs::path& path) {
  auto source = open_mosaic(mosaic, levels);
  if (!source) return fail(source);
  creation.SetNameValue("BLOCKSIZE", std::to_string(options.tile_size).c_str());
  creation.SetNameValue("NUM_THREADS", options.threads > 0 ? std::to_string(options.threads).c_str() : "ALL_CPUS");
  creation.SetNameValue("BIGTIFF", "IF_SAFER");
  creation.SetNameValue("SPARSE_OK", "YES");
  creation.SetNameValue("OVERVIEWS", levels.empty() ? "IGNORE_EXISTING" : "FORCE_USE_EXISTING");
  creation.SetNameValue("OVERVIEW_COUNT", std::to_string(level_sizes(mosaic.width, mosaic.height).size()).c_str());
  creation.SetNameValue("OVERVIEW_RESAMPLING", reduction == Reduction::Mode ? "MODE" : "AVERAGE");

  const gdal::GdalMessages messages;
  GdalProgress progress(options.show_progress);
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("COG");
  gdal::Dataset map{
      driver->CreateCopy(path.c_str(), source->get(), FALSE, creation.List(), &GdalProgress::report, &progress)};
  const bool written = map != nullptr;
  map.reset();  // what is still buffered is written here, and may fail here
  if (!written || messages.failed())
    return fail(Error::Kind::Io, fmt::format("{}: cannot be made: {}; is a source damaged, or the disk full?",
                                             options.output.string(), messages.first()));
  return {};
}

/// Reads the last tile of every level: level 0 lies last in the file, so one that was cut short fails here.
Result<void> check_readable(const fs::path& path, const fs::path& output) {
  auto map = gdal::open_raster(path.string());
  if (!map)
    return fail(Error::Kind::Io,
                fmt::format("{}: was not written as a readable file: {}", output.string(), map.error().message));
  const gdal::GdalMessages messages;
  GDALRasterBand& band = *(*map)->GetRasterBand(1);
  for (int i = -1; i < band.GetOverviewCount(); ++i) {
    GDALRasterBand& level = i < 0 ? band : *band.GetOverview(i);
    double sample = 0;
    if (level.RasterIO(GF_Read, level.GetXSize() - 1, level.GetYSize() - 1, 1, 1, &sample, 1, 1, GDT_Float64, 0, 0,
                       nullptr) != CE_None)
      return fail(Error::Kind::Io,
                  fmt::format("{}: was not written whole: {}; is the disk full?", output.string(), messages.first()));
  }
  return {};
}

/// Moves the map into place with what GDAL keeps beside it, and removes what belonged to the map that it replaces.
Result<void> put_in_place(const fs::path& from, const fs::path& to) {
  if (const auto ok = move_into_place(from, to); !ok) return fail(ok);
  for (const char* beside : {".aux.xml", ".ovr", ".msk"}) {
    std::error_code error;
    fs::remove(to.string() + beside, error);
    if (fs::exists(from.string() + beside, error))
      if (const auto ok = move_into_place(from.string() + beside, to.string() + beside); !ok) return fail(ok);
  }
  return {};
}

std::uint64_t raw_bytes(const tile::MapDescription& map) {
  std::uint64_t texel = 0, bytes = 0;
  for (const tile::Band& band : map.bands)
    texel += static_cast<std::uint64_t>(GDALGetDataTypeSizeBytes(GDALGetDataTypeByName(band.stored_type.c_str())));
  for (const tile::Level& level : map.levels)
    bytes += static_cast<std::uint64_t>(level.width) * static_cast<std::uint64_t>(level.height) * texel;
  return bytes;
}

}  // namespace

Result<BuildReport> build(const BuildOptions& given) {
  const auto start = std::chrono::steady_clock::now();
  if (const auto ok = check(given); !ok) return fail(ok);
  tile::limit_gdal_block_cache(given.memory_bytes);
  const QuietWorkers quiet;

  // What level 0 will be
  auto sources = open_sources(given.sources, given.bands, given.zoom);
  if (!sources) return fail(sources);
  BuildOptions options = given;
  options.role = role_of(given, *sources);
  if (given.radar_scale && options.role != tile::Role::Radar)
    return fail(Error::Kind::Unsupported,
                fmt::format("radar scale {}: it is for role radar", to_string(*given.radar_scale)));
  auto mosaic = lay_out(std::move(*sources), /*alpha_to_mask=*/options.compression == Compression::Jpeg);
  if (!mosaic) return fail(mosaic);
  if (options.role) set_metadata(*mosaic, "NADIR_ROLE", to_string(*options.role));
  set_metadata(*mosaic, "NADIR_ACQUIRED", options.acquired);
  set_metadata(*mosaic, "NADIR_ATTRIBUTION", options.attribution);
  set_metadata(*mosaic, "NADIR_LICENCE", options.licence);
  const Reduction reduction = choose_reduction(options.role, options.radar_scale, *mosaic);
  auto codec = codec_options(options, *mosaic);
  if (!codec) return fail(codec);

  // GDAL averages decibels as if they were power, and lets a NaN spread over all that is averaged with it.
  auto scratch = Scratch::beside(options.output);
  if (!scratch) return fail(scratch);
  std::vector<fs::path> levels;
  const bool floating = GDALDataTypeIsFloating(mosaic->sources.front().type);
  if (reduction == Reduction::MeanOfPower || (reduction == Reduction::Mean && floating)) {
    auto full = open_mosaic(*mosaic, {});
    if (!full) return fail(full);
    auto reduced = reduce(**full, *mosaic, reduction == Reduction::MeanOfPower ? Mean::Power : Mean::AsStored,
                          options.tile_size, *scratch, options.show_progress);
    if (!reduced) return fail(reduced);
    levels = std::move(*reduced);
  }

  const fs::path temporary = scratch->file("map.tif");
  if (const auto ok = write_map(*mosaic, levels, reduction, *codec, options, temporary); !ok) return fail(ok);
  if (const auto ok = check_readable(temporary, options.output); !ok) return fail(ok);
  const auto written = tile::describe(temporary.string());
  if (!written) return fail(written);
  if (const auto ok = put_in_place(temporary, options.output); !ok) return fail(ok);

  BuildReport report;
  report.output = options.output;
  for (const tile::Level& level : written->levels) report.levels.push_back({level.width, level.height});
  report.bands = static_cast<int>(written->bands.size());
  report.sample_type = written->bands.front().stored_type;
  report.reduction = to_string(reduction);
  report.raw_bytes = raw_bytes(*written);
  std::error_code error;
  report.file_bytes = fs::file_size(options.output, error);
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  report.warnings = mosaic->warnings;
  return report;
}

}  // namespace nadir::pyramid
