#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <map>
#include <memory>
#include <opencv2/core/utility.hpp>
#include <vector>

#include "maps.h"
#include "must.h"
#include "nadir/render/renderer.h"
#include "original.h"
#include "sections.h"

namespace nadir::bench {
namespace {

struct View {
  const char* name;
  int width_px, height_px;
  double focal_px;
};
/// From 500.5 m, the height of the original's flight.
constexpr std::array views = {
    View{"100 x 100, zoomed out 4.7 times (its flight)", 100, 100, 110},
    View{"512 x 512, 1:1 (its default camera)", 512, 512, 530},
    View{"1280 x 720, zoomed out 3.8 times", 1280, 720, 134.5},
};
constexpr double flight_height_m = 500.5;
/// North over the middle of the map, 20 m a frame, after one frame that is counted apart.
constexpr int frames = 21, rounds = 5;
constexpr double step_m = 20;

using Clock = std::chrono::steady_clock;
double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// Peak resident memory of this program. Unlike getrusage's it does not count the process that started it.
double peak_mib() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;)
    if (word == "VmHWM:") {
      double kib = 0;
      status >> kib;
      return kib / 1024;
    }
  return 0;
}

struct Cost {
  double first_ms = 0;    // from the start of the program, with reading what the method reads
  double frame_ms = 0;    // mean of the further frames
  double picture_ms = 0;  // of it, without the copy of the reference
  double peak_mib = 0;
};

Cost measured(const std::string& method, const std::filesystem::path& map, std::size_t view, int threads) {
  const std::string command =
      fmt::format("'{}' --measure {} '{}' {} {}", std::filesystem::read_symlink("/proc/self/exe").string(), method,
                  map.string(), view, threads);
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  Cost cost;
  if (!pipe ||
      std::fscanf(pipe.get(), "%lf %lf %lf %lf", &cost.first_ms, &cost.frame_ms, &cost.picture_ms, &cost.peak_mib) != 4)
    must(Result<void>(fail(Error::Kind::Io, command + ": expected four numbers")));
  return cost;
}

/// Median over the rounds of one figure.
double median(const std::vector<Cost>& costs, double Cost::*figure) {
  std::vector<double> values;
  for (const Cost& cost : costs) values.push_back(cost.*figure);
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

}  // namespace

int measure_cost(const std::string& method, const std::string& path, int view_index, int threads) {
  const auto start = Clock::now();
  const View& view = views.at(static_cast<std::size_t>(view_index));
  const auto camera = must(render::Camera::pinhole(view.width_px, view.height_px, view.focal_px, view.focal_px,
                                                   view.width_px / 2.0, view.height_px / 2.0));
  tile::limit_gdal_block_cache(16 << 20);
  const tile::Map map = must(tile::Map::open(path));
  Cost cost;
  const auto fly = [&](const auto& make_frame) {
    auto begin = start;
    for (int i = 0; i < frames; ++i) {
      make_frame(level(0, (i - frames / 2) * step_m, flight_height_m));
      (i == 0 ? cost.first_ms : cost.frame_ms) += ms_since(begin);
      begin = Clock::now();
    }
    cost.frame_ms /= frames - 1;
  };

  if (method == "original") {
    cv::setNumThreads(threads);
    const Original original(read_bgr(map), plane_of_true_metres(map));
    double pictures_ms = 0;
    fly([&](const EnuFromCamera& pose) {
      const auto begin = Clock::now();
      const auto footprint = original.footprint(camera, pose);
      if (!footprint) must(Result<void>(fail(Error::Kind::OutsideMap, path + ": the flight leaves the map")));
      const cv::Mat picture = original.picture(
          Original::sensor_from_reference(footprint->reference_px, Original::its_rectangle(camera)), camera);
      pictures_ms += ms_since(begin);
      const cv::Mat truth = original.truth_picture(*footprint);
    });
    cost.picture_ms = pictures_ms / frames;
  } else {
    const auto scene = render::Scene::plane(map.center(), {}).with_layer("eo", map, {.bands = {1, 2, 3}});
    render::Renderer renderer({.threads = threads});
    const render::RenderOptions options{.quality = must(render::parse_quality(method))};
    fly([&](const EnuFromCamera& pose) {
      must(renderer.render(scene, camera, scene.surface().frame().ecef_from_enu() * pose, options));
    });
    cost.picture_ms = cost.frame_ms;
  }
  fmt::print("{} {} {} {}\n", cost.first_ms, cost.frame_ms, cost.picture_ms, peak_mib());
  return 0;
}

std::string cost_section(const std::filesystem::path& work) {
  const auto map = paper_sized_map(work);
  std::string text = fmt::format(
      "## Memory and time\n\n{} x {} texels as in the paper (naip_2014.tif enlarged), three bands of 8 bits. Each row "
      "is the median of {} "
      "rounds, in which the methods take turns, each in a process of its own. First frame: from the start of the "
      "process. Warm frame: mean "
      "over a flight of {} further ones. The last three columns: the original's figure over this row's, above 1 where "
      "ours is the smaller.\n\n"
      "| view | threads | method | peak memory (MiB) | first frame (ms) | warm frame (ms) | of it, picture | memory | "
      "frame | picture |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
      paper_width, paper_height, rounds, frames - 1);
  const std::array<std::string, 3> methods = {"original", "draft", "balanced"};
  for (std::size_t view = 0; view < views.size(); ++view)
    for (const int threads : {1, 2}) {
      std::map<std::string, std::vector<Cost>> costs;
      for (int round = 0; round < rounds; ++round)
        for (const std::string& method : methods) costs[method].push_back(measured(method, map, view, threads));
      const auto of = [&](const std::string& method, double Cost::*figure) { return median(costs[method], figure); };
      const auto ratio = [&](const std::string& method, double Cost::*figure) {
        return of("original", figure) / of(method, figure);
      };
      for (const std::string& method : methods)
        text += fmt::format("| {} | {} | {} | {:.0f} | {:.0f} | {:.2f} | {:.2f} | {:.1f} | {:.1f} | {:.2f} |\n",
                            views[view].name, threads, method == "original" ? method : "ours, " + method,
                            of(method, &Cost::peak_mib), of(method, &Cost::first_ms), of(method, &Cost::frame_ms),
                            of(method, &Cost::picture_ms), ratio(method, &Cost::peak_mib),
                            ratio(method, &Cost::frame_ms), ratio(method, &Cost::picture_ms));
    }
  return text;
}

}  // namespace nadir::bench
