// What does a warm 1280x720 frame cost, beside warping the whole map in memory with OpenCV?
// Views of the Kampala map: 1:1, zoomed out 2 times (all of the map that fits), oblique by 50 degrees.
#include <benchmark/benchmark.h>

#include <array>

#include "nadir/render/renderer.h"

#ifdef NADIR_HAVE_OPENCV
#include <opencv2/imgproc.hpp>
#endif

namespace {

using namespace nadir;

struct View {
  double height_m, pitch_deg;
};
constexpr std::array<View, 3> views = {View{74.4, 0}, View{148.8, 0}, View{60, 50}};

const tile::Map& map() {
  static const tile::Map kampala = tile::Map::open(NADIR_SOURCE_DIR "/sim/demo/maps/kampala.tif").value();
  return kampala;
}
render::Camera camera() { return render::Camera::pinhole(1280, 720, 1000, 1000, 640, 360).value(); }
render::Scene scene() { return render::Scene::plane(map().center(), {}).with_layer("eo", map(), {.bands = {1, 2, 3}}); }
render::CameraPose pose(const View& view) {
  auto place = map().center();
  place.height_m = view.height_m;
  return render::camera_pose(place, geodesy::YawPitchRoll::degrees(30, view.pitch_deg, 0));
}

void BM_WarmFrame(benchmark::State& state, render::Quality quality) {
  const View& view = views[static_cast<std::size_t>(state.range(0))];
  render::Renderer renderer({.threads = static_cast<int>(state.range(1))});
  const auto s = scene();
  const auto c = camera();
  if (!renderer.render(s, c, pose(view), {.quality = quality}))
    return state.SkipWithError("no frame");  // reads the map
  for (auto _ : state) benchmark::DoNotOptimize(renderer.render(s, c, pose(view), {.quality = quality}));
  state.SetItemsProcessed(state.iterations() * 1280 * 720);  // pixels
}
const std::vector<std::vector<std::int64_t>> each_view_one_and_two_threads = {{0, 1, 2}, {1, 2}};
BENCHMARK_CAPTURE(BM_WarmFrame, draft, render::Quality::draft)
    ->ArgsProduct(each_view_one_and_two_threads)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(BM_WarmFrame, balanced, render::Quality::balanced)
    ->ArgsProduct(each_view_one_and_two_threads)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(BM_WarmFrame, best, render::Quality::best)
    ->ArgsProduct(each_view_one_and_two_threads)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

#ifdef NADIR_HAVE_OPENCV
/// The whole map in memory, one bilinear sample a pixel, no levels.
void BM_OpenCvWholeMap(benchmark::State& state) {
  const View& view = views[static_cast<std::size_t>(state.range(0))];
  cv::setNumThreads(static_cast<int>(state.range(1)));
  const std::array bands = {1, 2, 3};
  tile::Texels whole = map().read(0, {0, 0, map().width(), map().height()}, bands).value();
  const cv::Mat reference(map().height(), map().width(), CV_8UC3, whole.samples.data());
  render::Renderer renderer;
  const auto frame = renderer.render(scene(), camera(), pose(view)).value();
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> h = *frame.truth().image_pixel_from_map_pixel;
  const cv::Mat image_from_map(3, 3, CV_64F, const_cast<double*>(h.data()));
  cv::Mat out;
  for (auto _ : state) {
    cv::warpPerspective(reference, out, image_from_map, {1280, 720}, cv::INTER_LINEAR);
    benchmark::DoNotOptimize(out.data);
  }
  state.SetItemsProcessed(state.iterations() * 1280 * 720);
}
BENCHMARK(BM_OpenCvWholeMap)->ArgsProduct(each_view_one_and_two_threads)->Unit(benchmark::kMillisecond)->UseRealTime();
#endif

}  // namespace
