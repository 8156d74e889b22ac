#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "command.h"
#include "nadir/render/renderer.h"

namespace nadir::app {

/// What `nadir render` was asked for about one map: the options that follow its --map.
struct MapArguments {
  std::string path, name, role, bands, radar_scale, output, range;
};

struct RenderArguments {
  std::vector<MapArguments> maps;
  std::string camera, poses, folder;
  std::string origin, surface = "plane", ground_height = "0", mount;
  std::string quality = "balanced", filter, off_map = "mask";
  double geometry_tolerance_px = 0.05, fill_value = 0;
  std::optional<double> oversampling, level_blend, max_error, time_budget_ms;
  render::Shutter shutter;
  std::string cache = "256MiB", frame_memory = "1GiB", vehicle = "vehicle";
  int threads = 0;
  std::size_t first_frames = 0;  // 0: all
  bool force = false, no_output = false, no_pictures = false, json = false, explain = false, truth_planes = false,
       allow_coarse = false, adaptive = false;
};

/// Declares the options on `app`, to be parsed into `arguments`.
void add_render_options(CLI::App& app, RenderArguments& arguments);

/// Layers, vehicles and cameras name files of the dataset; `what` is for the message where `name` cannot.
Result<void> check_names_a_file(std::string_view what, std::string_view name);

/// The scene of the maps on the ground: opened, placed, checked.
Result<render::Scene> make_scene(const RenderArguments& arguments);
Result<render::Mount> make_mount(const RenderArguments& arguments);
Result<render::RenderOptions> make_render_options(const RenderArguments& arguments);
/// Rows of a band, where frames are to be made in bands: larger than --frame-memory. 0 where they are not.
Result<int> band_rows(const RenderArguments& arguments, const render::Scene& scene, const render::Camera& camera);
Result<render::RendererOptions> make_renderer_options(const RenderArguments& arguments);

}  // namespace nadir::app
