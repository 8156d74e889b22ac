#include "build_suite.h"

#include <cpl_error.h>
#include <fmt/format.h>
#include <gdal.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>

#include "builders.h"
#include "check_map.h"
#include "codec_alone.h"
#include "nadir/base/files.h"
#include "photo.h"
#include "two_zones.h"

namespace nadir::bench {
namespace {

namespace fs = std::filesystem;

std::int64_t side_of(const RunOptions& options) {
  return options.side > 0 ? options.side : options.quick ? 1024 : 16384;
}

fs::path kept_folder(const RunOptions& options) { return options.keep.empty() ? options.scratch : options.keep; }

double megabytes(std::int64_t side) { return static_cast<double>(side * side * 3) / 1e6; }

/// GDAL looks at what the builders made; what it has to say comes with our errors.
void use_gdal() {
  GDALAllRegister();
  CPLSetErrorHandler(CPLQuietErrorHandler);
}

/// What a build may leave, whole or not, goes.
void remove_output(const std::string& output) {
  std::error_code ignored;
  fs::remove_all(output, ignored);
  fs::remove_all(output + ".building", ignored);
}

/// Reads a file once, so that it comes from memory afterwards wherever it fits there.
void warm(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<char> block(1 << 20);
  while (file.read(block.data(), static_cast<std::streamsize>(block.size()))) {
  }
}

/// Before: no output, and nothing left to be written back that would slow what comes.
void start_clean(Method& method, const std::string& output) {
  method.before = [output]() -> Result<void> {
    remove_output(output);
    ::sync();
    return {};
  };
}

/// Completes a builder's method: its output is checked after each repetition and goes.
void check_after(Method& method, const std::string& source, const std::string& output, const BuildPacking& packing,
                 std::int64_t side) {
  start_clean(method, output);
  const auto found = std::make_shared<MapCheck>();
  method.after = [=]() -> Result<void> {
    const auto checked = check_map(output, source, packing.lossless());
    remove_output(output);
    if (!checked) return fail(checked);
    *found = *checked;
    return {};
  };
  if (!packing.lossless()) method.error = [found]() -> Result<double> { return found->rms; };
  method.counters = [found, side]() -> std::map<std::string, std::string> {
    return {{"written_bytes", std::to_string(found->bytes)},
            {"packing", fmt::format("{:.4g}", megabytes(side) * 1e6 * 4 / 3 / static_cast<double>(found->bytes))},
            {"levels", std::to_string(found->levels)}};
  };
}

/// One packing by all builders, and by the codec's library alone.
Case one_packing(const RunOptions& options, const BuildPacking& packing) {
  return {packing.name(), [=]() -> Result<Comparison> {
            const std::int64_t side = side_of(options);
            const auto photo = photo_file({.side = side}, kept_folder(options), build_threads);
            if (!photo) return fail(photo);
            // The largest output has 4/3 of the source's bytes; GDAL and nadir keep levels beside it meanwhile
            const auto bytes = static_cast<std::uint64_t>(side * side * 3);
            if (const auto room = expect_free(options.scratch, 3 * bytes); !room) return fail(room);
            warm(*photo);
            use_gdal();

            const std::string source = photo->string(), output = (fs::path(options.scratch) / "map.tif").string();
            const auto nadir = NadirBuild::find();
            Comparison comparison{.error_unit = "levels RMS", .work = megabytes(side), .work_unit = "MB"};
            auto& methods = comparison.methods;
            methods = {nadir_method(nadir, source, output, packing), vips_method(source, output, packing),
                       gdal_method(source, output, packing)};
            if (packing.codec == BuildCodec::none || (packing.codec == BuildCodec::deflate && packing.level == 6))
              methods.push_back(maketx_method(source, output, packing));
            for (Method& method : methods) check_after(method, source, output, packing, side);

            const auto alone = CodecAlone::make(source, packing);
            if (!alone) return fail(alone);
            const std::shared_ptr<CodecAlone> codec = *alone;
            methods.push_back({.name = packing.codec == BuildCodec::none ? "copy alone" : "codec alone",
                               .run = [codec] { return codec->run(); },
                               .before = []() -> Result<void> { return {}; },  // once a round
                               .counters = [codec]() -> std::map<std::string, std::string> {
                                 return {{"written_bytes", std::to_string(codec->packed_bytes())}};
                               }});
            const std::string first = label(methods[0].name, methods[0].setting);
            for (std::size_t i = 1; i < methods.size(); ++i)
              comparison.aims.push_back({.method = first,
                                         .baseline = label(methods[i].name, methods[i].setting),
                                         .most = i + 1 < methods.size() ? std::optional(1.0) : std::nullopt});
            comparison.warm_up = false;
            comparison.go_on = true;
            return comparison;
          }};
}

/// A raster of `times` x `times` copies of a square one, as a file of a few kilobytes.
Result<std::string> repeated(const fs::path& photo, std::int64_t side, int times, const fs::path& folder) {
  std::string vrt = fmt::format(
      "<VRTDataset rasterXSize=\"{0}\" rasterYSize=\"{0}\">\n<SRS>EPSG:32633</SRS>\n"
      "<GeoTransform>500000, 1, 0, 5400000, 0, -1</GeoTransform>\n",
      side * times);
  for (int band = 1; band <= 3; ++band) {
    constexpr std::array colours = {"Red", "Green", "Blue"};
    vrt += fmt::format("<VRTRasterBand dataType=\"Byte\" band=\"{}\"><ColorInterp>{}</ColorInterp>\n", band,
                       colours[static_cast<std::size_t>(band - 1)]);
    for (int i = 0; i < times * times; ++i)
      vrt += fmt::format(
          "<SimpleSource><SourceFilename>{}</SourceFilename><SourceBand>{}</SourceBand>"
          "<SrcRect xOff=\"0\" yOff=\"0\" xSize=\"{}\" ySize=\"{}\"/>"
          "<DstRect xOff=\"{}\" yOff=\"{}\" xSize=\"{}\" ySize=\"{}\"/></SimpleSource>\n",
          fs::absolute(photo).string(), band, side, side, i % times * side, i / times * side, side, side);
    vrt += "</VRTRasterBand>\n";
  }
  const fs::path path = folder / fmt::format("photo_{}.vrt", side * times);
  if (const auto written = write_file(path, vrt + "</VRTDataset>\n"); !written) return fail(written);
  return path.string();
}

/// What nadir takes for sources of growing size, packed as JPEG.
Case memory_by_size(const RunOptions& options) {
  return {"peak memory by side of the source", [=]() -> Result<Comparison> {
            const std::int64_t side = side_of(options);
            const auto nadir = NadirBuild::find();
            use_gdal();
            Comparison comparison{.warm_up = false, .go_on = true, .rounds = 1};
            const std::string output = (fs::path(options.scratch) / "map.tif").string();
            const BuildPacking packing{.codec = BuildCodec::jpeg};
            const auto add = [&](const std::string& source, std::int64_t of_side, const char* kind) {
              Method method = nadir_method(nadir, source, output, packing);
              method.setting = fmt::format("{} texels a side{}", of_side, kind);
              check_after(method, source, output, packing, of_side);
              method.error = nullptr;  // told by the case of this packing
              method.point = Point{"builds as JPEG", static_cast<double>(of_side), "side of the source, texels"};
              comparison.methods.push_back(std::move(method));
            };
            for (const std::int64_t s : {side / 4, side}) {
              const auto photo = photo_file({.side = s}, kept_folder(options), build_threads);
              if (!photo) return fail(photo);
              add(photo->string(), s, "");
              if (s < side || !options.large) continue;
              // A tenth of the samples is what JPEG leaves; levels and what is kept meanwhile come on top
              const auto bytes = static_cast<std::uint64_t>(side * side * 3) * 64;
              if (const auto room = expect_free(options.scratch, bytes / 3); !room) return fail(room);
              for (const int times : {4, 8}) {
                const auto vrt = repeated(*photo, side, times, options.scratch);
                if (!vrt) return fail(vrt);
                add(*vrt, side * times, ", a VRT");
              }
            }
            for (std::size_t i = 1; i < comparison.methods.size(); ++i)
              comparison.aims.push_back({.method = label(comparison.methods[i].name, comparison.methods[i].setting),
                                         .baseline = label(comparison.methods[0].name, comparison.methods[0].setting),
                                         .most = 1.1,
                                         .cost = Cost::peak});
            return comparison;
          }};
}

/// GDAL's careful way: a VRT a zone, the second one warped into the first one's coordinates, and a COG of both.
Result<Method> mosaic_by_gdal(const TwoZones& scenes, const fs::path& folder, const fs::path& scratch,
                              const std::string& output, const BuildPacking& packing) {
  const auto at = [&](const std::string& name) { return (scratch / name).string(); };
  for (const int zone : {32, 33}) {
    std::string list;
    for (const std::string& name : scenes.names(zone)) list += (folder / name).string() + "\n";
    if (const auto written = write_file(at(fmt::format("zone{}.txt", zone)), list); !written) return fail(written);
  }
  const auto vrt_of = [&](const std::string& zone) -> std::vector<std::string> {
    return {"gdalbuildvrt", "-q", "-overwrite", "-input_file_list", at(zone + ".txt"), at(zone + ".vrt")};
  };
  Method method{.name = "GDAL warp and COG", .command = vrt_of("zone32")};
  if (!on_path("gdalwarp")) method.left_out = "gdalwarp is not installed (package gdal-bin)";
  const std::string texel = fmt::format("{}", TwoZones::texel_m);
  method.then = {vrt_of("zone33"),
                 {"gdalwarp",
                  "-q",
                  "-overwrite",
                  "-of",
                  "VRT",
                  "-t_srs",
                  "EPSG:32632",
                  "-tr",
                  texel,
                  texel,
                  "-tap",
                  "-r",
                  "bilinear",
                  "-et",
                  "0.125",
                  "-srcnodata",
                  "0",
                  "-dstnodata",
                  "0",
                  "-wo",
                  fmt::format("NUM_THREADS={}", build_threads),
                  at("zone33.vrt"),
                  at("zone33_warped.vrt")},
                 {"gdalbuildvrt", "-q", "-overwrite", at("both.vrt"), at("zone32.vrt"), at("zone33_warped.vrt")},
                 gdal_cog_command(at("both.vrt"), output, packing)};
  return method;
}

Method mosaic_by_nadir(const fs::path& folder, const std::string& output, const BuildPacking& packing) {
  Method method{.name = "nadir"};
  const auto nadir = NadirBuild::find();
  if (!nadir) {
    method.left_out = nadir.error().message;
  } else if (!nadir->knows("--crs")) {
    method.left_out = "this `nadir build` has no --crs: it cannot bring zones together";
  } else {
    method.command = nadir->command({folder.string()}, output,
                                    {{"--role", "optical"},
                                     {"--crs", "EPSG:32632"},
                                     {"--gsd", fmt::format("{}", TwoZones::texel_m)},
                                     {"--interpolation", "bilinear"},
                                     {"--filter", "box"},
                                     {"--compress", "zstd"},
                                     {"--level", std::to_string(packing.level)},
                                     {"--predictor", "horizontal"},
                                     {"--tile-size", std::to_string(build_tile_side)},
                                     {"--memory", fmt::format("{}MiB", build_memory_mib)},
                                     {"--threads", std::to_string(build_threads)}},
                                    method.setting);
  }
  return method;
}

/// Scenes of two UTM zones become one map.
Case mosaic(const RunOptions& options) {
  const int count = options.sources > 0 ? options.sources : options.quick ? 4 : 400;
  return {fmt::format("mosaic of {} scenes in two UTM zones", count), [=]() -> Result<Comparison> {
            use_gdal();
            const auto scenes = std::make_shared<const TwoZones>(count);
            const auto raw = static_cast<std::uint64_t>(count) * TwoZones::side * TwoZones::side * 3;
            if (const auto room = expect_free(options.scratch, 3 * raw); !room) return fail(room);
            const auto folder = scenes->write(kept_folder(options), build_threads);
            if (!folder) return fail(folder);
            for (const int zone : {32, 33})
              for (const std::string& name : scenes->names(zone)) warm(*folder / name);

            const std::string output = (fs::path(options.scratch) / "mosaic.tif").string();
            const BuildPacking packing{.codec = BuildCodec::zstd, .level = 9};
            auto by_gdal = mosaic_by_gdal(*scenes, fs::absolute(*folder), options.scratch, output, packing);
            if (!by_gdal) return fail(by_gdal);
            Comparison comparison{.error_unit = "texels", .work = static_cast<double>(raw) / 1e6, .work_unit = "MB"};
            comparison.methods = {mosaic_by_nadir(*folder, output, packing), std::move(*by_gdal)};
            for (Method& method : comparison.methods) {
              start_clean(method, output);
              const auto found = std::make_shared<MosaicError>();
              const auto bytes = std::make_shared<std::uint64_t>(0);
              method.after = [=]() -> Result<void> {
                const auto errors = scenes->errors_of(output);
                std::error_code ignored;
                *bytes = fs::file_size(output, ignored);
                remove_output(output);
                if (!errors) return fail(errors);
                *found = *errors;
                return {};
              };
              method.error = [found]() -> Result<double> { return found->position_rms_texels; };
              method.counters = [=]() -> std::map<std::string, std::string> {
                return {{"written_bytes", std::to_string(*bytes)},
                        {"position_max_texels", fmt::format("{:.4g}", found->position_max_texels)},
                        {"rms", fmt::format("{:.4g}", found->rms)},
                        {"seam_rms", fmt::format("{:.4g}", found->seam_rms)},
                        {"seam_max", fmt::format("{:.4g}", found->seam_max)},
                        {"blocks", std::to_string(found->blocks)},
                        {"seam_texels", std::to_string(found->seam_texels)}};
              };
            }
            comparison.aims = {{.method = label(comparison.methods[0].name, comparison.methods[0].setting),
                                .baseline = comparison.methods[1].name,
                                .most = 1.0}};
            comparison.warm_up = false;
            comparison.go_on = true;
            return comparison;
          }};
}

}  // namespace

Suite build_suite() {
  return {"build", "pyramids beside libvips, GDAL, maketx and the codecs alone", [](const RunOptions& options) {
            std::vector<Case> cases;
            for (const BuildPacking packing : {BuildPacking{.codec = BuildCodec::none},
                                               {.codec = BuildCodec::jpeg},
                                               {.codec = BuildCodec::jpeg, .half_chroma = false},
                                               {.codec = BuildCodec::deflate, .level = 6},
                                               {.codec = BuildCodec::zstd, .level = 1},
                                               {.codec = BuildCodec::zstd, .level = 3},
                                               {.codec = BuildCodec::zstd, .level = 9}})
              cases.push_back(one_packing(options, packing));
            cases.push_back(memory_by_size(options));
            cases.push_back(mosaic(options));
            return cases;
          }};
}

}  // namespace nadir::bench
