// What does sampling cost by itself, one thread, texels in cells in memory? Beside OpenCV's warp of the same texels.
// A frame's worth of blocks is sampled, so that cells come from where a frame finds them: the level's 12 MB of three
// bytes a texel fit no second-level cache. Views: turned by 30 degrees at 1:1; 1.4 texels a pixel, where levels change;
// oblique, the far side half as large.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <map>

#include "sample_with.h"
#include "support/level_in_memory.h"

#ifdef NADIR_HAVE_OPENCV
#include <opencv2/imgproc.hpp>
#endif

namespace {

using namespace nadir;

constexpr int level_side = 2048, frame_width = 1024, frame_height = 768, block_side = 64;

enum class View { turned, minified, oblique };
constexpr std::array view_names = {"turned", "minified", "oblique"};

/// Level-0 texels of image points.
Eigen::Matrix3d texel_from_image(View view) {
  Eigen::Matrix3d h = Eigen::Matrix3d::Identity();
  if (view == View::oblique) {
    h << 0.7, 0.1, 100, 0, 0.4, 50, 0, -0.5 / frame_height, 1;  // 0.5 to 1.4 texels a pixel
    return h;
  }
  const double scale = view == View::turned ? 1 : 1.4, angle = view == View::turned ? 0.52 : 0.1;
  h.topLeftCorner<2, 2>() = scale * Eigen::Rotation2Dd(angle).toRotationMatrix();
  h.topRightCorner<2, 1>() = Eigen::Vector2d(420, 60);
  return h;
}

double noise(int col, int row, int band) {
  return static_cast<double>((static_cast<unsigned>(col * 73 + row * 151 + band * 37) * 2654435761u) >> 24);
}

const test::LevelInMemory& level(tile::SampleType type, int bands, bool masked, int side = level_side) {
  static std::map<std::tuple<tile::SampleType, int, bool, int>, std::unique_ptr<test::LevelInMemory>> levels;
  auto& made = levels[{type, bands, masked, side}];
  if (!made)
    made = std::make_unique<test::LevelInMemory>(
        type, bands, side, side, noise,
        masked ? test::LevelInMemory::Valid([](int col, int row) { return (col / 8 + row / 8) % 16 != 0; })
               : test::LevelInMemory::Valid());
  return *made;
}

struct Question {
  const render::Kernels* kernels;
  render::SampleFormat format;
  View view = View::turned;
  render::Interpolation interpolation = render::Interpolation::Bilinear;
  int samples = 1;  // along each side of a pixel
  bool masked = false;
  bool two_levels = false;
};

void BM_Sample(benchmark::State& state, const Question& q) {
  const Eigen::Matrix3d h = texel_from_image(q.view);
  std::vector<render::LevelWindow> windows = {level(q.format.type, q.format.bands, q.masked).window()};
  if (q.two_levels) windows.push_back(level(q.format.type, q.format.bands, q.masked, level_side / 2).window(1, 2));
  std::vector<std::byte> out(static_cast<std::size_t>(frame_width) * frame_height *
                             static_cast<std::size_t>(q.format.bands) * tile::size_bytes(q.format.type));
  std::vector<std::uint8_t> validity(static_cast<std::size_t>(frame_width) * frame_height);
  for (auto _ : state) {
    for (int y = 0; y < frame_height; y += block_side)
      for (int x = 0; x < frame_width; x += block_side) {
        render::BlockSampling block;
        block.width = block.height = block_side;
        Eigen::Matrix3d to_corner = Eigen::Matrix3d::Identity();
        to_corner.topRightCorner<2, 1>() = Eigen::Vector2d(x, y);
        block.texel_from_image = h * to_corner;
        block.map_width = block.map_height = level_side;
        block.inside = true;
        block.interpolation = q.interpolation;
        block.samples_x = block.samples_y = q.samples;
        block.levels = windows;
        if (q.two_levels) block.level_at_corner = {0.4, 0.4, 0.6, 0.6};
        const std::size_t first = static_cast<std::size_t>(y) * frame_width + static_cast<std::size_t>(x);
        const render::BlockTarget target{
            block.levels,
            out.data() + first * static_cast<std::size_t>(q.format.bands) * tile::size_bytes(q.format.type),
            validity.data() + first};
        render::sample_block_with(*q.kernels, block, q.format, {&target, 1}, frame_width);
      }
    benchmark::ClobberMemory();
  }
  state.counters["ns/px"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * frame_width * frame_height * 1e-9,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

#ifdef NADIR_HAVE_OPENCV
void BM_OpenCv(benchmark::State& state, const render::SampleFormat& format, View view, int interpolation) {
  const int depth = format.type == tile::SampleType::UInt8    ? CV_8U
                    : format.type == tile::SampleType::UInt16 ? CV_16U
                                                              : CV_32F;
  cv::setNumThreads(1);
  cv::Mat texels(level_side, level_side, CV_MAKETYPE(depth, format.bands)), out;
  cv::randu(texels, 0, 255);
  cv::Mat h(3, 3, CV_64F);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) h.at<double>(r, c) = texel_from_image(view)(r, c);
  for (auto _ : state) {
    cv::warpPerspective(texels, out, h, {frame_width, frame_height}, interpolation | cv::WARP_INVERSE_MAP);
    benchmark::DoNotOptimize(out.data);
  }
  state.counters["ns/px"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * frame_width * frame_height * 1e-9,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
#endif

const bool registered = [] {
  using render::Interpolation, tile::SampleType;
  const render::SampleFormat rgb{SampleType::UInt8, 3};
  const std::array<render::SampleFormat, 5> formats = {
      rgb, {SampleType::UInt8, 1}, {SampleType::UInt16, 4}, {SampleType::Float32, 1}, {SampleType::Float32, 11}};
  const auto add = [](const std::string& what, const Question& q) {
    const std::string name = fmt::format("{}/{}x{}/{}/{}", q.kernels->name, to_string(q.format.type), q.format.bands,
                                         view_names[static_cast<std::size_t>(q.view)], what);
    benchmark::RegisterBenchmark(name.c_str(), [q](benchmark::State& state) {
      BM_Sample(state, q);
    })->Unit(benchmark::kMillisecond);
  };
  for (const render::Kernels* kernels : render::all_kernels()) {
    for (const auto& format : formats) {
      add("bilinear", {kernels, format});
      add("cubic", {kernels, format, View::turned, Interpolation::Cubic});
    }
    for (const View view : {View::minified, View::oblique}) add("bilinear", {kernels, rgb, view});
    add("nearest", {kernels, rgb, View::turned, Interpolation::Nearest});
    add("2x2 samples", {kernels, rgb, View::turned, Interpolation::Bilinear, 2});
    add("masked", {kernels, rgb, View::turned, Interpolation::Bilinear, 1, true});
    add("two levels", {kernels, rgb, View::minified, Interpolation::Bilinear, 1, false, true});
  }
#ifdef NADIR_HAVE_OPENCV
  for (std::size_t i = 0; i < 4; ++i)
    for (const auto& [how, interpolation] : {std::pair{"bilinear", cv::INTER_LINEAR}, {"cubic", cv::INTER_CUBIC}})
      benchmark::RegisterBenchmark(
          fmt::format("OpenCV/{}x{}/turned/{}", to_string(formats[i].type), formats[i].bands, how).c_str(),
          [format = formats[i], interpolation = interpolation](benchmark::State& state) {
            BM_OpenCv(state, format, View::turned, interpolation);
          })
          ->Unit(benchmark::kMillisecond);
#endif
  return true;
}();

}  // namespace
