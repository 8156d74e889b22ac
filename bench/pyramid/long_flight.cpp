#include "long_flight.h"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>

#include "builders.h"
#include "nadir/base/files.h"
#include "nadir/bench/measure.h"
#include "photo.h"

namespace nadir::bench {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t strip_height = 1024;  // texels
constexpr double texel_m = 0.5, north_m = 5'400'000, middle_m = 500'000;
constexpr double height_m = 600;  // a frame sees 768 m along the way

struct Flight {
  std::int64_t map_side = std::int64_t{1} << 20;  // texels
  double way_m = 500'000;
  int frames = 1000;
  double side_m() const { return static_cast<double>(map_side) * texel_m; }
  double west_m() const { return middle_m - side_m() / 2; }
};

/// The photograph's middle rows, `count` times along the middle row of the map: rasters of a few hundred bytes.
Result<void> write_strip(const Flight& flight, const fs::path& photo, std::int64_t side, const fs::path& folder) {
  const std::int64_t rows = std::min(strip_height, side);
  const double top = north_m - static_cast<double>((flight.map_side - rows) / 2) * texel_m;
  for (std::int64_t i = 0; i < flight.map_side / side; ++i) {
    std::string vrt = fmt::format(
        "<VRTDataset rasterXSize=\"{}\" rasterYSize=\"{}\">\n<SRS>EPSG:32633</SRS>\n"
        "<GeoTransform>{}, {}, 0, {}, 0, {}</GeoTransform>\n",
        side, rows, flight.west_m() + static_cast<double>(i * side) * texel_m, texel_m, top, -texel_m);
    for (int band = 1; band <= 3; ++band)
      vrt += fmt::format(
          "<VRTRasterBand dataType=\"Byte\" band=\"{0}\"><ColorInterp>{1}</ColorInterp><SimpleSource>"
          "<SourceFilename>{2}</SourceFilename><SourceBand>{0}</SourceBand>"
          "<SrcRect xOff=\"0\" yOff=\"{3}\" xSize=\"{4}\" ySize=\"{5}\"/>"
          "<DstRect xOff=\"0\" yOff=\"0\" xSize=\"{4}\" ySize=\"{5}\"/></SimpleSource></VRTRasterBand>\n",
          band,
          band == 1   ? "Red"
          : band == 2 ? "Green"
                      : "Blue",
          fs::absolute(photo).string(), (side - rows) / 2, side, rows);
    if (const auto ok = write_file(folder / fmt::format("part_{:04}.vrt", i), vrt + "</VRTDataset>\n"); !ok) return ok;
  }
  return {};
}

/// Along the great circle through the map's middle, which a transverse Mercator projection maps to one northing.
Result<void> write_flight(const Flight& flight, const fs::path& camera, const fs::path& poses) {
  if (const auto ok = write_file(camera,
                                 "image_width: 1280\nimage_height: 720\ncamera_name: down\n"
                                 "camera_matrix: {rows: 3, cols: 3, data: [1000, 0, 639.5, 0, 1000, 359.5, 0, 0, 1]}\n"
                                 "distortion_model: plumb_bob\n"
                                 "distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n");
      !ok)
    return ok;
  std::string csv = "t_s,x_m,y_m,z_m,qx,qy,qz,qw\n";
  for (int i = 0; i < flight.frames; ++i)
    csv +=
        fmt::format("{},{},0,{},1,0,0,0\n", i, (static_cast<double>(i) / flight.frames - 0.5) * flight.way_m, height_m);
  return write_file(poses, csv);
}

Result<Usage> build_map(const Flight& flight, const fs::path& sources, const std::string& map) {
  const auto nadir = NadirBuild::find();
  if (!nadir) return fail(nadir);
  std::string left_out;
  const auto command =
      nadir->command({sources.string()}, map,
                     {{"--role", "optical"},
                      {"--compress", "jpeg"},
                      {"--memory", fmt::format("{}MiB", build_memory_mib)},
                      {"--threads", std::to_string(build_threads)},
                      {"--extent", fmt::format("{:.1f},{:.1f},{:.1f},{:.1f}", flight.west_m(),
                                               north_m - flight.side_m(), flight.west_m() + flight.side_m(), north_m)}},
                     left_out);
  if (!left_out.empty()) return fail(Error::Kind::Unsupported, "this `nadir build` works " + left_out);
  return measure_command(command);
}

std::vector<std::string> render_command(const fs::path& folder, const std::string& map, int first) {
  std::error_code ignored;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored).parent_path() / "nadir-render";
  return {program.string(),
          "--map",
          map,
          "--camera",
          (folder / "camera.yaml").string(),
          "--poses",
          (folder / "poses.csv").string(),
          "--off-map",
          "reject",
          "--cache",
          "64MiB",
          "--threads",
          std::to_string(build_threads),
          "--first",
          std::to_string(first),
          "--no-output"};
}

}  // namespace

Case long_flight(const RunOptions& options) {
  return {"flight over a sparse map", [=]() -> Result<Comparison> {
            const fs::path folder = fs::path(options.scratch) / "flight";
            const Flight flight = options.quick ? Flight{std::int64_t{1} << 16, 30'000, 60} : Flight{};
            const std::int64_t side = std::min<std::int64_t>(options.side > 0 ? options.side
                                                             : options.quick  ? 1024
                                                                              : 16384,
                                                             16384);
            const auto photo =
                photo_file({.side = side}, options.keep.empty() ? options.scratch : options.keep, build_threads);
            if (!photo) return fail(photo);
            std::error_code problem;
            fs::create_directories(folder / "parts", problem);
            if (problem) return fail(Error::Kind::Io, folder.string() + ": " + problem.message());
            if (const auto ok = write_strip(flight, *photo, side, folder / "parts"); !ok) return fail(ok);
            if (const auto ok = write_flight(flight, folder / "camera.yaml", folder / "poses.csv"); !ok)
              return fail(ok);
            const std::string map = (folder / "map.tif").string();
            const auto built = build_map(flight, folder / "parts", map);
            if (!built) return fail(built);

            Comparison comparison{.warm_up = false, .rounds = 1};
            for (const int count : {flight.frames / 10, flight.frames}) {
              Method method{.name = "nadir render",
                            .setting = fmt::format("{} km over {} texels a side",
                                                   count * flight.way_m / flight.frames / 1000, flight.map_side),
                            .command = render_command(folder, map, count)};
              method.counters = [built = *built, map]() -> std::map<std::string, std::string> {
                std::error_code ignored;
                return {{"written_bytes", std::to_string(fs::file_size(map, ignored))},
                        {"build_ms", fmt::format("{:.0f}", built.wall_ms)},
                        {"build_peak_bytes", std::to_string(built.peak_bytes.value_or(0))}};
              };
              comparison.methods.push_back(std::move(method));
            }
            comparison.aims = {{.method = label("nadir render", comparison.methods[1].setting),
                                .baseline = label("nadir render", comparison.methods[0].setting),
                                .most = 1.1,
                                .cost = Cost::peak}};
            return comparison;
          }};
}

}  // namespace nadir::bench
