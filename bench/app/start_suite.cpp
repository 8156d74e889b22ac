// What does a command cost before it has anything to do? Beside GDAL's own, on the same map.
#include <filesystem>

#include "nadir/bench/procedural_tiff.h"
#include "suites.h"

namespace nadir::bench {
namespace {

Result<Comparison> look_at_a_map(const std::string& scratch) {
  const std::string map = scratch + "/start.tif";
  if (const auto written = write_map(map, {.width = 2048, .height = 2048, .codec = Codec::zstd}, true); !written)
    return fail(written);
  const auto nadir = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "nadir";
  return Comparison{.methods = {{.name = "nadir --version", .command = {nadir, "--version"}},
                                {.name = "nadir info", .command = {nadir, "info", map}},
                                {.name = "gdalinfo", .command = {"gdalinfo", map}}},
                    .aims = {{.method = "nadir info", .baseline = "gdalinfo"}}};
}

}  // namespace

Suite start_suite() {
  return {"start", "what a command costs before it has anything to do",
          [](const RunOptions& options) -> std::vector<Case> {
            return {{"look at a map of 2048 x 2048", [=] { return look_at_a_map(options.scratch); }}};
          }};
}

}  // namespace nadir::bench
