// nadir build: makes a map with levels from rasters, folders of rasters or map tiles.
#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>
#include <string>

#include "command.h"
#include "nadir/base/text.h"
#include "nadir/pyramid/build.h"

namespace {
using namespace nadir;

constexpr auto description =
    "Makes a map: a cloud-optimized GeoTIFF with all its levels, from which frames are rendered fast.\n"
    "SOURCE is any raster that GDAL reads, a folder of rasters, a text file (.txt) that lists them, or a folder of\n"
    "map tiles DIR/{zoom}/{x}/{y}.png. Several come onto one grid, in the CRS of the first and with the texels of\n"
    "the finest, later ones on top.\n"
    "What is done is kept in MAP.building until the map is whole: after an interruption the same command goes on.";

constexpr auto examples =
    "Examples:\n"
    "  nadir build ortho.tif -o map.tif --role optical --acquired 2014-07-20 --licence \"public domain\"\n"
    "  nadir build s1.tif -o sar.tif --role radar --bands VV,VH          levels are averaged in power\n"
    "  nadir build tiles/ -o town.tif --zoom 21 --compress jpeg --quality 90\n"
    "  nadir build scenes/ -o country.tif --crs EPSG:3035 --gsd 10       thousands of scenes in several UTM zones\n"
    "  nadir build map.tif -o onboard.tif --ortho --crs EPSG:32630 --gsd 5 --extent 700000,4185000,760000,4225000\n"
    "  nadir build scenes/ -o country.tif --shard 3/16                   one of 16 processes, then --join 16";

/// What the command line says, as text.
struct Words {
  std::string output, bands, role, radar_scale, overlap = "last", interpolation, filter, compression = "zstd",
                                                predictor, chroma = "420", extent, shard, memory = "512MiB";
  bool ortho = false, json = false;
};

void add_sources(CLI::App& command, pyramid::BuildOptions& options, Words& words) {
  command.add_option("SOURCE", options.sources, "rasters, folders of rasters, lists of rasters, folders of map tiles")
      ->required();
  command.add_option("-o,--output", words.output, "the map to write")->required()->type_name("MAP");
  command.add_flag("--force", options.force, "replace MAP if it is there");
  const auto group = "What goes into the map";
  command
      .add_option(
          "--role", words.role,
          "what it shows: optical, radar, infrared, elevation, labels or field; decides how levels are averaged")
      ->type_name("ROLE")
      ->group(group);
  command
      .add_option("--bands", words.bands,
                  "names or numbers from 1, such as VV,VH or 4,3,2; else all. Alpha always stays")
      ->type_name("LIST")
      ->group(group);
  command
      .add_option("--radar-scale", words.radar_scale,
                  "how radar samples relate to power: decibel (default where they are floats) or linear")
      ->type_name("SCALE")
      ->group(group);
  command.add_option("--zoom", options.zoom, "which zoom of a tile folder to take, else the deepest there")
      ->type_name("Z")
      ->group(group);
  command.add_option("--overlap", words.overlap, "which source lies on top: last, first, newest, oldest or finest")
      ->capture_default_str()
      ->type_name("RULE")
      ->group(group);
  command
      .add_option("--acquired", options.acquired,
                  "when the imagery was taken: 2014-07-20, or with time 2014-07-20T17:05:00Z")
      ->type_name("DATE")
      ->group(group);
  command.add_option("--attribution", options.attribution, "whom to credit")->type_name("TEXT")->group(group);
  command.add_option("--licence", options.licence, "terms under which the imagery may be used")
      ->type_name("TEXT")
      ->group(group);
}

void add_grid(CLI::App& command, pyramid::BuildOptions& options, Words& words) {
  const auto group = "Grid of the map, else the CRS of the first source and the texels of the finest";
  command.add_option("--crs", options.grid.crs, "EPSG:code, WKT or PROJ string")->type_name("CRS")->group(group);
  command.add_option("--gsd", options.grid.gsd, "side of a texel in units of the CRS")->type_name("SIZE")->group(group);
  command.add_option("--extent", words.extent, "left,bottom,right,top in units of the CRS")
      ->type_name("BOX")
      ->group(group);
  command.add_flag("--ortho", words.ortho, "render SOURCE onto the grid given here: an onboard reference")
      ->group(group);
  command
      .add_option("--interpolation", words.interpolation,
                  "nearest, bilinear or cubic, where texels must move; else bilinear, nearest for labels")
      ->type_name("KIND")
      ->group(group);
  command
      .add_option("--tolerance", options.tolerance_texels,
                  "greatest error of where texels move to, in texels of the source")
      ->capture_default_str()
      ->type_name("T")
      ->group(group);
}

void add_file(CLI::App& command, pyramid::BuildOptions& options, Words& words) {
  const auto group = "Levels and tiles";
  command
      .add_option("--filter", words.filter,
                  "how a level comes from the one before: box, gaussian, lanczos, nearest or mode; else mode for "
                  "labels, box for radar, lanczos")
      ->type_name("FILTER")
      ->group(group);
  command.add_option("--compress", words.compression, "none, deflate, zstd, lzw, lzma, jpeg, webp or lerc")
      ->capture_default_str()
      ->type_name("CODEC")
      ->group(group);
  command
      .add_option("--level", options.level, "of deflate (1 to 12, else 6), zstd (1 to 22, else 9, of labels 15) and lzma (0 to 9)")
      ->type_name("N")
      ->group(group);
  command
      .add_option("--predictor", words.predictor,
                  "none, horizontal or float: what is packed instead of samples; else what suits them")
      ->type_name("KIND")
      ->group(group);
  command.add_option("--quality", options.quality, "of jpeg and webp, 1 to 100, else 90; webp loses nothing at 100")
      ->type_name("N")
      ->group(group);
  command
      .add_option("--chroma", words.chroma, "of jpeg: 420 halves the resolution of colour differences, 444 keeps it")
      ->capture_default_str()
      ->type_name("KIND")
      ->group(group);
  command.add_option("--max-error", options.max_error, "that lerc may make, in stored units; 0 loses nothing")
      ->capture_default_str()
      ->type_name("E")
      ->group(group);
  command.add_option("--tile-size", options.tile_size, "side of a stored tile, texels: a multiple of 16, 128 to 1024")
      ->capture_default_str()
      ->type_name("N")
      ->group(group);
}

void add_work(CLI::App& command, pyramid::BuildOptions& options, Words& words) {
  const auto group = "How it is made";
  command.add_option("--memory", words.memory, "what it may take at most, about")
      ->capture_default_str()
      ->type_name("SIZE")
      ->group(group);
  command.add_option("--threads", options.threads, "0: one a core")
      ->capture_default_str()
      ->type_name("N")
      ->group(group);
  command
      .add_option("--shard", words.shard,
                  "make part I of N only, into MAP.shard-I-of-N: for N processes, on one machine or many")
      ->type_name("I/N")
      ->group(group);
  command.add_option("--join", options.join, "bring N shards together: the same bytes as made at once")
      ->type_name("N")
      ->group(group);
  command.add_flag("--explain", options.explain, "say how it would be made, and do nothing")->group(group);
  command.add_flag("--json", words.json, "tell the outcome as JSON");
}

/// Sets `value` from the word that the option was given, if any.
template <class Value, class Parse>
Result<void> take(std::string_view option, const std::string& word, Value& value, Parse parse) {
  if (word.empty()) return {};
  const auto parsed = parse(word);
  if (!parsed) return fail(parsed.error().kind, fmt::format("{}: {}", option, parsed.error().message));
  value = *parsed;
  return {};
}

Result<tiff::Predictor> parse_predictor(std::string_view name) {
  static constexpr std::array<std::string_view, 3> names = {"none", "horizontal", "float"};
  static constexpr std::array kinds = {tiff::Predictor::None, tiff::Predictor::Horizontal,
                                       tiff::Predictor::FloatingPoint};
  return parse_name<std::size_t>("predictor", name, names).map([](std::size_t i) { return kinds[i]; });
}

Result<mosaic::Interpolation> parse_interpolation(std::string_view name) {
  static constexpr std::array<std::string_view, 3> names = {"nearest", "bilinear", "cubic"};
  return parse_name<mosaic::Interpolation>("interpolation", name, names);
}

Result<bool> parse_chroma(std::string_view name) {
  static constexpr std::array<std::string_view, 2> names = {"444", "420"};
  return parse_name<bool>("kind of chroma", name, names);
}

Result<pyramid::Shard> parse_shard(const std::string& text) {
  pyramid::Shard shard;
  int end = 0;
  if (std::sscanf(text.c_str(), "%d/%d%n", &shard.number, &shard.count, &end) != 2 ||
      static_cast<std::size_t>(end) != text.size())
    return fail(Error::Kind::Malformed, fmt::format("'{}': expected I/N, such as 3/16", text));
  return shard;
}

Result<std::array<double, 4>> parse_extent(const std::string& text) {
  const auto numbers = app::parse_numbers("--extent", text, 4, 4, "700000,4185000,760000,4225000");
  if (!numbers) return fail(numbers);
  const std::array<double, 4> box = {(*numbers)[0], (*numbers)[1], (*numbers)[2], (*numbers)[3]};
  if (!(box[0] < box[2] && box[1] < box[3]))
    return fail(Error::Kind::Malformed, fmt::format("'{}': expected left,bottom,right,top with left < right and bottom "
                                                    "< top",
                                                    text));
  return box;
}

Result<void> interpret(const Words& words, pyramid::BuildOptions& options) {
  options.output = words.output;
  if (!words.bands.empty())
    for (const std::string_view band : split(words.bands, ',')) options.bands.emplace_back(band);
  Result<void> ok;
  const auto then = [&](std::string_view option, const std::string& word, auto& value, auto parse) {
    if (ok) ok = take(option, word, value, parse);
  };
  then("--role", words.role, options.role, tile::parse_role);
  then("--radar-scale", words.radar_scale, options.radar_scale, tile::parse_radar_scale);
  then("--overlap", words.overlap, options.overlap, mosaic::parse_overlap);
  then("--interpolation", words.interpolation, options.interpolation, parse_interpolation);
  then("--filter", words.filter, options.filter, pyramid::parse_filter);
  then("--compress", words.compression, options.compression, pyramid::parse_compression);
  then("--predictor", words.predictor, options.predictor, parse_predictor);
  then("--chroma", words.chroma, options.subsample_chroma, parse_chroma);
  then("--extent", words.extent, options.grid.extent, parse_extent);
  then("--shard", words.shard, options.shard, parse_shard);
  then("--memory", words.memory, options.memory_bytes, parse_bytes);
  if (ok && words.ortho && options.grid.crs.empty() && !options.grid.gsd && !options.grid.extent)
    return fail(Error::Kind::Malformed, "--ortho: expected a grid to render onto: --crs, --gsd or --extent");
  return ok;
}

double ratio(const pyramid::BuildReport& report) {
  return report.file_bytes > 0 ? static_cast<double>(report.raw_bytes) / static_cast<double>(report.file_bytes) : 0;
}

void print_summary(const pyramid::BuildReport& report, const pyramid::BuildOptions& options) {
  fmt::print("{}: {} x {}, {} {} of {}, {} {}", report.output.string(), report.levels.front().width,
             report.levels.front().height, report.bands, report.bands == 1 ? "band" : "bands", report.sample_type,
             report.levels.size(), report.levels.size() == 1 ? "level" : "levels");
  if (report.levels.size() > 1)
    fmt::print(" to {} x {} by {}", report.levels.back().width, report.levels.back().height, report.reduction);
  if (options.shard) {
    fmt::print("\npart {} of {} is made, in {:.1f} s; when all are, --join {}\n", options.shard->number,
               options.shard->count, report.seconds, options.shard->count);
    return;
  }
  fmt::print("\n{}, {:.1f} times less than its samples, in {:.1f} s", format_bytes(report.file_bytes), ratio(report),
             report.seconds);
  if (report.kept_chunks > 0) fmt::print(", {} squares of which were there from an earlier run", report.kept_chunks);
  if (report.empty_tiles > 0)
    fmt::print("\n{} of {} tiles hold nothing and take no room", report.empty_tiles, report.tiles);
  if (report.source_blocks > 0)
    fmt::print("\nblocks of the sources decoded: {}, {:.2f} times their number", report.blocks_decoded,
               static_cast<double>(report.blocks_decoded) / static_cast<double>(report.source_blocks));
  fmt::print("\n");
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
  json["tiles"] = report.tiles;
  json["empty_tiles"] = report.empty_tiles;
  json["kept_squares"] = report.kept_chunks;
  json["source_blocks"] = report.source_blocks;
  json["blocks_decoded"] = report.blocks_decoded;
  json["seconds"] = report.seconds;
  json["plan"] = report.plan;
  json["warnings"] = report.warnings;
  // Names of files are bytes and need not be UTF-8.
  fmt::print("{}\n", json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

}  // namespace

int main(int argc, char** argv) {
  pyramid::BuildOptions options;
  Words words;
  CLI::App command(description, "nadir build");
  command.footer(examples);
  add_sources(command, options, words);
  add_grid(command, options, words);
  add_file(command, options, words);
  add_work(command, options, words);
  return app::run_command(command, argc, argv, [&]() -> Result<void> {
    if (const auto ok = interpret(words, options); !ok) return ok;
    const auto report = pyramid::build(options);
    if (!report) return fail(report);
    for (const std::string& warning : report->warnings) fmt::print(stderr, "nadir build: warning: {}\n", warning);
    if (words.json) {
      print_json(*report);
    } else if (options.explain) {
      for (const std::string& line : report->plan) fmt::print("{}\n", line);
    } else {
      print_summary(*report, options);
    }
    return {};
  });
}
