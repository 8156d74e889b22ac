// What does it cost to write a frame of 1280x720, and which PNG settings pack it best for their time?
// NADIR_BENCH_IMAGE names a PNG or TIFF (uint8, 3 channels or more) of real ground, which is magnified to a frame
// as a camera would see it: invented images pack unlike real ones.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "nadir/record/image_files.h"

namespace nadir::record {
namespace {

constexpr int frame_width = 1280, frame_height = 720;

/// The image's middle, bilinear at 1.5 pixels a texel.
std::optional<Image> frame() {
  const char* path = std::getenv("NADIR_BENCH_IMAGE");
  const auto files = image_files();
  if (!path || !files) return std::nullopt;
  const auto map = (*files)->read(path);
  if (!map || map->type != tile::SampleType::UInt8 || map->channels < 3 || map->width < 2 || map->height < 2)
    return std::nullopt;

  Image out{{}, tile::SampleType::UInt8, frame_width, frame_height, 3};
  out.samples.resize(out.view().size_bytes());
  auto* sample = out.samples.data();
  for (int y = 0; y < frame_height; ++y) {
    for (int x = 0; x < frame_width; ++x) {
      const double u = std::clamp((x - frame_width / 2) / 1.5 + map->width / 2, 0.0, map->width - 1.001);
      const double v = std::clamp((y - frame_height / 2) / 1.5 + map->height / 2, 0.0, map->height - 1.001);
      const int i = static_cast<int>(u), j = static_cast<int>(v);
      for (int c = 0; c < 3; ++c) {
        const auto texel = [&](int col, int row) {
          return static_cast<double>(
              map->samples[static_cast<std::size_t>((row * map->width + col) * map->channels + c)]);
        };
        const double top = std::lerp(texel(i, j), texel(i + 1, j), u - i);
        const double bottom = std::lerp(texel(i, j + 1), texel(i + 1, j + 1), u - i);
        *sample++ = static_cast<std::byte>(std::lround(std::lerp(top, bottom, v - j)));
      }
    }
  }
  return out;
}

/// Encodes into memory with one choice of strategy, zlib level and filter (libpng's flag; 0 lets libpng choose by row).
void BM_PngSettings(benchmark::State& state, const char* strategy) {
  const auto image = frame();
  if (!image) return state.SkipWithError("NADIR_BENCH_IMAGE: expected a uint8 PNG or TIFF with 3 channels or more");
  OIIO::attribute("threads", 1);
  OIIO::ImageSpec spec(frame_width, frame_height, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("compression", strategy);
  spec.attribute("png:compressionLevel", static_cast<int>(state.range(0)));
  spec.attribute("png:filter", static_cast<int>(state.range(1)));
  std::vector<unsigned char> bytes;
  for (auto _ : state) {
    bytes.clear();
    OIIO::Filesystem::IOVecOutput memory(bytes);
    const auto output = OIIO::ImageOutput::create("frame.png", &memory);
    output->open("frame.png", spec);
    output->write_image(OIIO::TypeDesc::UINT8, image->samples.data());
    output->close();
  }
  state.counters["kB"] = static_cast<double>(bytes.size()) / 1000;
}
// Filters: by row, Sub, Up, Average, Paeth
BENCHMARK_CAPTURE(BM_PngSettings, default, "default")
    ->ArgsProduct({{1, 2, 4, 6}, {0, 16, 32, 64, 128}})
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_PngSettings, rle, "rle")->ArgsProduct({{1}, {0, 16, 32, 64, 128}})->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_PngSettings, huffman, "huffman")
    ->ArgsProduct({{1}, {0, 16, 32, 64, 128}})
    ->Unit(benchmark::kMillisecond);

/// Writes files as the recorder does; the float frame holds the first channel as if it were dB.
void BM_WriteFrame(benchmark::State& state, const char* extension, bool as_float) {
  const auto image = frame();
  if (!image) return state.SkipWithError("NADIR_BENCH_IMAGE: expected a uint8 PNG or TIFF with 3 channels or more");
  std::vector<float> decibels;
  for (std::size_t i = 0; i < image->samples.size(); i += 3)
    decibels.push_back(0.1f * std::to_integer<std::uint8_t>(image->samples[i]) - 25.0f);
  const ImageView view =
      as_float ? ImageView{decibels.data(), tile::SampleType::Float32, frame_width, frame_height, 1} : image->view();
  const auto path = std::filesystem::temp_directory_path() / (std::string("nadir_record_bench") + extension);
  for (auto _ : state) {
    if (!image_files().value()->write(path, view)) return state.SkipWithError("writing failed");
  }
  state.counters["kB"] = static_cast<double>(std::filesystem::file_size(path)) / 1000;
  std::filesystem::remove(path);
}
BENCHMARK_CAPTURE(BM_WriteFrame, png_rgb8, ".png", false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_WriteFrame, tif_rgb8, ".tif", false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_WriteFrame, tif_float, ".tif", true)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace nadir::record
