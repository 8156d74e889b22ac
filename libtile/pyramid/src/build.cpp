#include "nadir/pyramid/build.h"

#include <fmt/format.h>

#include <chrono>

#include "build_run.h"
#include "nadir/base/files.h"
#include "nadir/gdal/dataset.h"
#include "nadir/tile/map.h"

namespace nadir::pyramid {
namespace fs = std::filesystem;
namespace {

Result<void> check_output(const BuildOptions& options) {
  std::error_code error;
  if (fs::is_directory(options.output, error))
    return fail(Error::Kind::Exists,
                fmt::format("{}: is a folder; name a file, such as map.tif in it", options.output.string()));
  return options.shard ? Result<void>() : refuse_to_overwrite(options.output, options.force);
}

/// Moves the map into place, and removes what GDAL kept beside the one that it replaces.
Result<void> put_in_place(const fs::path& from, const fs::path& to) {
  if (const auto ok = move_into_place(from, to); !ok) return fail(ok);
  for (const char* beside : {".aux.xml", ".ovr", ".msk"}) {
    std::error_code error;
    fs::remove(to.string() + beside, error);
  }
  return {};
}

}  // namespace

Result<BuildReport> build(const BuildOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  if (const auto ok = check_options(options); !ok) return fail(ok);
  if (const auto ok = check_output(options); !ok) return fail(ok);
  tile::limit_gdal_block_cache(options.memory_bytes / 8);
  const gdal::QuietGdal quiet;
  auto design = pyramid::design(options);
  if (!design) return fail(design);
  auto run = BuildRun::plan(options, *design);
  if (!run) return fail(run);

  BuildReport report;
  report.output = options.output;
  if (!options.explain) {
    if (const auto ok = (*run)->make_tiles(); !ok) return fail(ok);
    if (options.shard) {
      report.output = (*run)->folder();
    } else {
      const auto map = (*run)->put_together();
      if (!map) return fail(map);
      if (const auto ok = put_in_place(*map, options.output); !ok) return fail(ok);
      (*run)->clean_up();
      std::error_code error;
      report.file_bytes = fs::file_size(options.output, error);
    }
  }
  (*run)->fill(report);
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return report;
}

}  // namespace nadir::pyramid
