// nadir build: makes a map with levels from rasters or tile folders.
#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>

#include "command.h"
#include "nadir/base/text.h"
#include "nadir/pyramid/build.h"

namespace {
using namespace nadir;

constexpr auto description =
    "Makes a map: a cloud-optimized GeoTIFF with all its levels, from which frames are rendered fast.\n"
    "SOURCE is any raster that GDAL reads, or a folder of map tiles DIR/{zoom}/{x}/{y}.png. Several become\n"
    "one mosaic, later ones on top; they agree in CRS, texel size and bands.";

constexpr auto examples =
    "Examples:\n"
    "  nadir build ortho.tif -o map.tif --role optical --acquired 2014-07-20 --licence \"public domain\"\n"
    "  nadir build s1.tif -o sar.tif --role radar --bands VV,VH          levels are averaged in power\n"
    "  nadir build tiles/ -o town.tif --zoom 21 --compress jpeg --quality 90\n"
    "  nadir build north.tif south.tif -o both.tif                       a mosaic";

double ratio(const pyramid::BuildReport& report) {
  return report.file_bytes > 0 ? static_cast<double>(report.raw_bytes) / static_cast<double>(report.file_bytes) : 0;
}

void print_summary(const pyramid::BuildReport& report) {
  fmt::print("{}: {} x {}, {} {} of {}, {} {}", report.output.string(), report.levels.front().width,
             report.levels.front().height, report.bands, report.bands == 1 ? "band" : "bands", report.sample_type,
             report.levels.size(), report.levels.size() == 1 ? "level" : "levels");
  if (report.levels.size() > 1)
    fmt::print(" to {} x {} by {}", report.levels.back().width, report.levels.back().height, report.reduction);
  fmt::print("\n{}, {:.1f} times less than its samples, in {:.1f} s\n", format_bytes(report.file_bytes), ratio(report),
             report.seconds);
}

void print_json(const pyramid::BuildReport& report) {
  nlohmann::ordered_json json;
  json["map"] = report.output.string();
  json["levels"] = nlohmann::ordered_json::array();
  for (const auto& level : report.levels) json["levels"].push_back({{"width", level.width}, {"height", level.height}});
  json["bands"] = report.bands;
  json["sample_type"] = report.sample_type;
  json["reduction"] = report.reduction;
  json["raw_bytes"] = report.raw_bytes;
  json["file_bytes"] = report.file_bytes;
  json["compression_ratio"] = ratio(report);
  json["seconds"] = report.seconds;
  json["warnings"] = report.warnings;
  // Names of files are bytes and need not be UTF-8.
  fmt::print("{}\n", json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

}  // namespace

int main(int argc, char** argv) {
  pyramid::BuildOptions options;
  std::string output, bands, role, radar_scale, compression = "zstd", memory = "512MiB";
  bool json = false;

  CLI::App command(description, "nadir build");
  command.footer(examples);
  command.add_option("SOURCE", options.sources, "rasters, or folders of map tiles")->required();
  command.add_option("-o,--output", output, "the map to write")->required()->type_name("MAP");
  command
      .add_option(
          "--role", role,
          "what it shows: optical, radar, infrared, elevation, labels or field; decides how levels are averaged")
      ->type_name("ROLE");
  command.add_option("--bands", bands, "names or numbers from 1, such as VV,VH or 4,3,2; else all. Alpha always stays")
      ->type_name("LIST");
  command
      .add_option("--radar-scale", radar_scale,
                  "how radar samples relate to power: decibel (default where they are floats) or linear")
      ->type_name("SCALE");
  command.add_option("--compress", compression, "none, deflate, zstd, lzw, jpeg, webp or lerc")
      ->capture_default_str()
      ->type_name("CODEC");
  command.add_option("--quality", options.quality, "of jpeg and webp, 1 to 100, else 90; webp loses nothing at 100")
      ->type_name("N");
  command.add_option("--max-error", options.max_error, "that lerc may make, in stored units; 0 loses nothing")
      ->capture_default_str()
      ->type_name("E");
  command.add_option("--tile-size", options.tile_size, "side of a stored tile, texels")
      ->capture_default_str()
      ->type_name("N");
  command.add_option("--zoom", options.zoom, "which zoom of a tile folder to take, else the deepest there")
      ->type_name("Z");
  command
      .add_option("--acquired", options.acquired,
                  "when the imagery was taken: 2014-07-20, or with time 2014-07-20T17:05:00Z")
      ->type_name("DATE");
  command.add_option("--attribution", options.attribution, "whom to credit")->type_name("TEXT");
  command.add_option("--licence", options.licence, "terms under which the imagery may be used")->type_name("TEXT");
  command.add_option("--memory", memory, "for GDAL's cache of blocks")->capture_default_str()->type_name("SIZE");
  command.add_option("--threads", options.threads, "that compress; 0: one a core")
      ->capture_default_str()
      ->type_name("N");
  command.add_flag("--force", options.force, "replace MAP if it is there");
  command.add_flag("--json", json, "tell the outcome as JSON");
  return app::run_command(command, argc, argv, [&]() -> Result<void> {
    options.output = output;
    if (!bands.empty())
      for (const std::string_view band : split(bands, ',')) options.bands.emplace_back(band);
    if (!role.empty()) {
      const auto parsed = tile::parse_role(role);
      if (!parsed) return fail(parsed.error().kind, "--role: " + parsed.error().message);
      options.role = *parsed;
    }
    if (!radar_scale.empty()) {
      const auto parsed = tile::parse_radar_scale(radar_scale);
      if (!parsed) return fail(parsed.error().kind, "--radar-scale: " + parsed.error().message);
      options.radar_scale = *parsed;
    }
    const auto codec = pyramid::parse_compression(compression);
    if (!codec) return fail(codec.error().kind, "--compress: " + codec.error().message);
    options.compression = *codec;
    const auto bytes = parse_bytes(memory);
    if (!bytes) return fail(bytes.error().kind, "--memory: " + bytes.error().message);
    options.memory_bytes = *bytes;

    const auto report = pyramid::build(options);
    if (!report) return fail(report);
    for (const std::string& warning : report->warnings) fmt::print(stderr, "nadir build: warning: {}\n", warning);
    if (json)
      print_json(*report);
    else
      print_summary(*report);
    return {};
  });
}
