#include "render_arguments.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "nadir/base/text.h"
#include "nadir/geodesy/height.h"
#include "nadir/sim/scene_setup.h"

namespace nadir::app {
namespace {

Result<render::LayerOptions> layer_options(const MapArguments& arguments, const tile::Map& map) {
  sim::MapSetup setup;
  if (!arguments.role.empty()) {
    const auto role = tile::parse_role(arguments.role);
    if (!role) return fail(role.error().kind, "--role: " + role.error().message);
    setup.role = *role;
  }
  if (!arguments.bands.empty())
    for (std::string_view band : split(arguments.bands, ',')) setup.bands.emplace_back(band);
  if (!arguments.radar_scale.empty()) {
    const auto scale = tile::parse_radar_scale(arguments.radar_scale);
    if (!scale) return fail(scale.error().kind, "--radar-scale: " + scale.error().message);
    setup.radar_scale = *scale;
  }
  std::optional<tile::SampleType> output;
  if (!arguments.output.empty()) {
    const auto type = tile::parse_sample_type(arguments.output);
    if (!type) return fail(type.error().kind, "--output: " + type.error().message);
    output = *type;
  }
  std::optional<std::pair<double, double>> range;
  if (!arguments.range.empty()) {
    const auto values = parse_numbers("--range", arguments.range, 2, 2, "0,3000");
    if (!values) return fail(values);
    range = {(*values)[0], (*values)[1]};
  }
  return sim::layer_options(map, setup, output, range);
}

/// lat,lon,height in degrees and metres; the height may carry a datum.
Result<sim::OriginSetup> parse_origin(const std::string& text) {
  const std::vector<std::string_view> fields = split(text, ',');
  const auto lat_lon = fields.size() == 3
                           ? parse_numbers("--origin", text.substr(0, text.rfind(',')), 2, 2, "38.1,-0.76,0")
                           : parse_numbers("--origin", text, 3, 3, "38.1,-0.76,0");
  if (!lat_lon) return fail(lat_lon);
  if (std::abs((*lat_lon)[0]) > 90 || std::abs((*lat_lon)[1]) > 360)
    return fail(
        Error::Kind::Malformed,
        fmt::format("--origin '{}': expected a latitude of at most 90 and a longitude of at most 360 degrees", text));
  const auto height = geodesy::parse_height(fields[2]);
  if (!height) return fail(height.error().kind, "--origin: " + height.error().message);
  return sim::OriginSetup{(*lat_lon)[0], (*lat_lon)[1], *height};
}

}  // namespace

void add_render_options(CLI::App& app, RenderArguments& a) {
  // An option of a map goes to the --map before it: parsed at once, in order.
  const auto of_map = [&](const char* name, std::string MapArguments::*member, const char* help) {
    app.add_option_function<std::string>(
           name,
           [&a, member, name](const std::string& value) {
             if (a.maps.empty()) throw CLI::ValidationError(name, "comes after the --map that it is about");
             a.maps.back().*member = value;
           },
           help)
        ->trigger_on_parse()
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast)
        ->group("Maps (options of a map follow it)");
  };
  app.add_option_function<std::string>(
         "--map", [&a](const std::string& path) { a.maps.push_back({path}); },
         "a georeferenced raster, on disk or behind a URL; may be given several times, one layer each")
      ->trigger_on_parse()
      ->required()
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast)
      ->group("Maps (options of a map follow it)");
  of_map("--name", &MapArguments::name, "name of the layer and its sensor (the file's stem)");
  of_map("--role", &MapArguments::role,
         "optical, radar, infrared, elevation, labels or field (the map's own, else optical)");
  of_map("--bands", &MapArguments::bands, "numbers or names, such as 4,3,2 or VV (all)");
  of_map("--radar-scale", &MapArguments::radar_scale, "decibel or linear (decibel for floats)");
  of_map("--output", &MapArguments::output, "type of the frames: uint8, int16, uint16 or float32 (the map's)");
  of_map("--range", &MapArguments::range, "LOW,HIGH: map values that become the type's lowest and highest");

  app.add_option("--camera", a.camera, "camera calibration, YAML as ROS writes it")->required()->group("View");
  app.add_option("--poses", a.poses,
                 "CSV: t_s,lat_deg,lon_deg,height_m,yaw_deg,pitch_deg,roll_deg of the vehicle\nor "
                 "t_s,x_m,y_m,z_m,qx,qy,qz,qw of the camera (enu_from_camera)")
      ->required()
      ->group("View");
  app.add_option("--mount", a.mount,
                 "x_m,y_m,z_m,yaw_deg,pitch_deg,roll_deg of the camera on the vehicle (looking down, top to the nose)")
      ->group("View");
  app.add_option("--exposure", a.shutter.exposure_s,
                 "seconds that each row is exposed for, about the pose's time; the camera moves as the poses do (0)")
      ->group("View");
  app.add_option("--readout", a.shutter.readout_s,
                 "seconds from the exposure of the image's upper edge to that of its lower one: a rolling shutter (0)")
      ->group("View");
  app.add_option("--origin", a.origin,
                 "lat,lon,height of the scene origin in degrees and metres (first map's centre at ground height)")
      ->group("View");
  app.add_option("--surface", a.surface, "plane: tangent at the origin; or ellipsoid: the curved Earth")
      ->capture_default_str()
      ->group("View");
  app.add_option("--ground-height", a.ground_height, "of the surface: metres above the ellipsoid, or '12 msl'")
      ->capture_default_str()
      ->group("View");

  CLI::Option* quality =
      app.add_option("--quality", a.quality, "draft, balanced or best")->capture_default_str()->group("Rendering");
  CLI::Option* filter =
      app.add_option("--filter", a.filter, "nearest, bilinear, bicubic, mip or reference (the quality's)")
          ->group("Rendering");
  CLI::Option* max_error =
      app.add_option(
             "--max-error", a.max_error,
             "root mean square error against the reference filter, in the frame's values: the cheapest way of sampling "
             "that is expected to keep it is taken (instead of a quality; maps of nadir build)")
          ->group("Rendering");
  CLI::Option* oversampling =
      app.add_option("--oversampling", a.oversampling,
                     "samples across a footprint's shorter axis (the quality's); of filter reference, a texel (2)")
          ->group("Rendering");
  CLI::Option* time_budget =
      app.add_option("--time-budget", a.time_budget_ms,
                     "milliseconds a frame: before the first one a few are tried, and the finest way of sampling whose "
                     "slowest one keeps the budget is taken for all, and recorded (instead of --quality, --filter, "
                     "--oversampling or --max-error)")
          ->excludes(quality)
          ->excludes(filter)
          ->excludes(max_error)
          ->excludes(oversampling)
          ->group("Rendering");
  app.add_flag("--adaptive", a.adaptive,
               "with --time-budget: choose anew for each frame from how long those before took; records say with what "
               "each was made, and no two runs make the same bytes")
      ->needs(time_budget)
      ->group("Rendering");
  app.add_option("--level-blend", a.level_blend,
                 "part of a level, 0 to 1, over which two levels are blended around where they switch (the quality's)")
      ->group("Rendering");
  app.add_option("--geometry-tolerance", a.geometry_tolerance_px, "largest geometric error in image pixels")
      ->capture_default_str()
      ->group("Rendering");
  app.add_option("--off-map", a.off_map, "mask, fill or reject, where a frame sees what no map covers")
      ->capture_default_str()
      ->group("Rendering");
  app.add_option("--fill-value", a.fill_value, "with --off-map fill")->capture_default_str()->group("Rendering");
  app.add_flag(
         "--allow-coarse", a.allow_coarse,
         "do not wait for map tiles that are not in memory: coarser levels stand for them, and the frame's record "
         "says so (settings.coarse). Such frames depend on what was in memory: no two runs need give the same")
      ->group("Rendering");
  app.add_option("--cache", a.cache, "memory for decoded map tiles")->capture_default_str()->group("Rendering");
  app.add_option("--frame-memory", a.frame_memory,
                 "memory for the pixels of a frame; larger frames are made and written in bands of rows, with the same "
                 "bytes, in this or 64 MiB, whichever is less, but in no less than 64 rows")
      ->capture_default_str()
      ->group("Rendering");
  app.add_option("--threads", a.threads, "0: all the machine has")
      ->capture_default_str()
      ->check(CLI::Range(0, 1024))
      ->group("Rendering");
  app.add_option("--first", a.first_frames, "render only the first N poses")
      ->check(CLI::Range(0, 1000000000))
      ->group("Rendering");

  app.add_option("-o,--output-folder", a.folder, "folder for frames, masks, frames.jsonl, camera file and pictures")
      ->group("Output");
  app.add_option("--vehicle", a.vehicle, "name in the folder and the records")->capture_default_str()->group("Output");
  app.add_flag("--force", a.force, "replace an earlier dataset in the folder")->group("Output");
  app.add_flag("--no-pictures", a.no_pictures, "no contact sheets and no maps with footprints")->group("Output");
  CLI::Option* no_output = app.add_flag("--no-output", a.no_output, "render and measure only")->group("Output");
  app.add_flag("--truth-planes", a.truth_planes,
               "beside each frame <nanoseconds>.truth.tif: longitude, latitude, height, range, incidence angle and "
               "ground sample distance of every pixel")
      ->excludes(no_output)
      ->group("Output");
  app.add_flag("--explain", a.explain, "say how the first frame is made, what is left out, why, and what took how long")
      ->group("Output");
  app.add_flag("--json", a.json, "summary (and explanation) for programs")->group("Output");
  app.footer(
      "examples:\n"
      "  nadir render --map kampala.tif --bands 1,2,3 --camera rgb.yaml --poses flight.csv -o frames\n"
      "  nadir render --map s2.tif --name eo --bands B4,B3,B2 --output uint8 --range 0,3000 \\\n"
      "               --map s1.tif --name sar --role radar --bands VV --camera cam.yaml --poses flight.csv -o pair");
}

Result<void> check_names_a_file(std::string_view what, std::string_view name) {
  if (!name.empty() && name != "." && name != ".." && name.find('/') == std::string_view::npos) return {};
  return fail(Error::Kind::Malformed,
              fmt::format("{} '{}': expected a name that a file can have, without '/'", what, name));
}

Result<render::Scene> make_scene(const RenderArguments& arguments) {
  std::vector<tile::Map> maps;
  for (const MapArguments& m : arguments.maps) {
    auto map = tile::Map::open(m.path);
    if (!map) return fail(map);
    maps.push_back(std::move(*map));
  }
  const auto shape = sim::parse_surface_shape(arguments.surface);
  if (!shape) return fail(shape.error().kind, "--surface: " + shape.error().message);
  const auto typed = geodesy::parse_height(arguments.ground_height);
  if (!typed) return fail(typed.error().kind, "--ground-height: " + typed.error().message);
  if (typed->datum == geodesy::HeightDatum::Agl)
    return fail(Error::Kind::Malformed,
                "--ground-height: expected a height above the ellipsoid or msl: it is the ground");

  std::optional<sim::OriginSetup> origin;
  if (!arguments.origin.empty()) {
    const auto parsed = parse_origin(arguments.origin);
    if (!parsed) return fail(parsed);
    origin = *parsed;
  }
  const auto ground = sim::ground_surface(*shape, origin, *typed, maps.front());
  if (!ground) return fail(ground);

  render::Scene scene = render::Scene::over(*ground);
  for (std::size_t i = 0; i < maps.size(); ++i) {
    const MapArguments& m = arguments.maps[i];
    auto options = layer_options(m, maps[i]);
    if (!options) return fail(options);
    const std::string name = m.name.empty() ? std::filesystem::path(m.path).stem().string() : m.name;
    if (auto ok = check_names_a_file("--name", name); !ok) return fail(ok);
    scene = scene.with_layer(name, maps[i], std::move(*options));
  }
  if (auto ok = scene.check(); !ok) return fail(ok);
  return scene;
}

Result<render::Mount> make_mount(const RenderArguments& arguments) {
  render::Mount mount;
  if (arguments.mount.empty()) return mount;
  const auto v = parse_numbers("--mount", arguments.mount, 6, 6, "0,0,0,0,-30,0");
  if (!v) return fail(v);
  mount.position_m = {(*v)[0], (*v)[1], (*v)[2]};
  mount.angles = geodesy::YawPitchRoll::degrees((*v)[3], (*v)[4], (*v)[5]);
  return mount;
}

Result<render::RenderOptions> make_render_options(const RenderArguments& arguments) {
  render::RenderOptions options;
  const auto quality = render::parse_quality(arguments.quality);
  if (!quality) return fail(quality);
  options.quality = *quality;
  if (!arguments.filter.empty()) {
    const auto filter = render::parse_filter(arguments.filter);
    if (!filter) return fail(filter);
    options.filter = *filter;
  }
  const auto off_map = render::parse_off_map(arguments.off_map);
  if (!off_map) return fail(off_map);
  options.off_map = *off_map;
  options.fill_value = arguments.fill_value;
  options.max_error = arguments.max_error;
  options.allow_coarse = arguments.allow_coarse;
  options.oversampling = arguments.oversampling;
  options.level_blend = arguments.level_blend;
  options.geometry_tolerance_px = arguments.geometry_tolerance_px;
  return options;
}

Result<int> band_rows(const RenderArguments& arguments, const render::Scene& scene, const render::Camera& camera) {
  const auto limit = parse_bytes(arguments.frame_memory);
  if (!limit) return fail(limit.error().kind, "--frame-memory: " + limit.error().message);
  std::uint64_t pixel_bytes = 0;
  for (const render::Layer& layer : scene.layers()) {
    const std::uint64_t bands = layer.source->bands().size();
    const tile::SampleType type = layer.options.output ? layer.options.output->type : layer.source->type();
    pixel_bytes += bands * std::max(tile::size_bytes(layer.source->type()), tile::size_bytes(type)) + 1;
    if (arguments.shutter.exposure_s > 0) pixel_bytes += bands * sizeof(float) + sizeof(std::uint16_t);  // their mean
  }
  const std::uint64_t row_bytes = pixel_bytes * static_cast<std::uint64_t>(camera.width_px());
  if (row_bytes * static_cast<std::uint64_t>(camera.height_px()) <= *limit) return 0;
  const auto in_bands = [&](const char* option, const char* why) {
    return fail(Error::Kind::Unsupported,
                fmt::format("{}: frames of {} x {} pixels take more than the {} of --frame-memory, so they are made in "
                            "bands, {}: leave it out, or allow more memory",
                            option, camera.width_px(), camera.height_px(), format_bytes(*limit), why));
  };
  if (arguments.truth_planes) return in_bands("--truth-planes", "and truth planes are not");
  if (arguments.allow_coarse) return in_bands("--allow-coarse", "which wait for their map tiles");
  constexpr std::uint64_t band_bytes = 64 << 20;  // enough for all processors to be busy
  const std::uint64_t rows = std::min(*limit, band_bytes) / row_bytes / render::block_px * render::block_px;
  return static_cast<int>(std::max<std::uint64_t>(rows, render::block_px));
}

Result<render::RendererOptions> make_renderer_options(const RenderArguments& arguments) {
  const auto cache_bytes = parse_bytes(arguments.cache);
  if (!cache_bytes) return fail(cache_bytes.error().kind, "--cache: " + cache_bytes.error().message);
  return render::RendererOptions{.cache_bytes = *cache_bytes, .threads = arguments.threads};
}

}  // namespace nadir::app
