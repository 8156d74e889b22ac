#include "check_map.h"

#include <cpl_error.h>
#include <fmt/format.h>
#include <gdal.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <vector>

#include "builders.h"

namespace nadir::bench {
namespace {

struct CloseDataset {
  void operator()(GDALDatasetH dataset) const { GDALClose(dataset); }
};
using Dataset = std::unique_ptr<void, CloseDataset>;

/// JPEG of quality 90 changes noisy texels by 3 to 5 levels, and colour at half resolution by some more where roads
/// meet fields; texels of another place or another channel differ by 20 and more.
constexpr double most_rms = 10;
constexpr int window = 64, windows = 64;

Result<Dataset> open(const std::string& path) {
  Dataset dataset(GDALOpen(path.c_str(), GA_ReadOnly));
  if (!dataset) return fail(Error::Kind::Damaged, fmt::format("{}: does not open: {}", path, CPLGetLastErrorMsg()));
  return dataset;
}

Result<std::vector<unsigned char>> texels(const Dataset& dataset, int x, int y, int width, int height) {
  std::vector<unsigned char> out(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3);
  if (GDALDatasetRasterIO(dataset.get(), GF_Read, x, y, width, height, out.data(), width, height, GDT_Byte, 3, nullptr,
                          3, 3 * width, 1) != CE_None)
    return fail(Error::Kind::Damaged, fmt::format("texels at ({}, {}): {}", x, y, CPLGetLastErrorMsg()));
  return out;
}

/// Sizes of the levels below level 0: those that GDAL takes for overviews, else (maketx does not mark them as such) the
/// file's further directories.
std::vector<std::array<int, 2>> lower_levels(const std::string& map, const Dataset& dataset) {
  std::vector<std::array<int, 2>> sizes;
  GDALRasterBandH band = GDALGetRasterBand(dataset.get(), 1);
  for (int i = 0; i < GDALGetOverviewCount(band); ++i) {
    GDALRasterBandH level = GDALGetOverview(band, i);
    sizes.push_back({GDALGetRasterBandXSize(level), GDALGetRasterBandYSize(level)});
  }
  for (int directory = 2; GDALGetOverviewCount(band) == 0; ++directory) {
    const auto level = open(fmt::format("GTIFF_DIR:{}:{}", directory, map));
    if (!level) break;
    sizes.push_back({GDALGetRasterXSize(level->get()), GDALGetRasterYSize(level->get())});
  }
  return sizes;
}

Result<void> check_levels(const std::string& map, const Dataset& dataset, MapCheck& found) {
  int width = GDALGetRasterXSize(dataset.get()), height = GDALGetRasterYSize(dataset.get());
  const auto sizes = lower_levels(map, dataset);
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const auto [w, h] = sizes[i];
    if (w < width / 2 || w > (width + 1) / 2 || h < height / 2 || h > (height + 1) / 2)
      return fail(Error::Kind::Damaged, fmt::format("{}: level {} has {} x {} texels, expected half of {} x {}", map,
                                                    i + 1, w, h, width, height));
    width = w;
    height = h;
  }
  found.levels = static_cast<int>(sizes.size()) + 1;
  if (std::max(width, height) > build_tile_side)
    return fail(Error::Kind::Damaged, fmt::format("{}: its coarsest level has {} x {} texels, expected at most {}", map,
                                                  width, height, build_tile_side));
  return {};
}

}  // namespace

Result<MapCheck> check_map(const std::string& map, const std::string& source, bool lossless) {
  const auto made = open(map), truth = open(source);
  if (!made) return fail(made);
  if (!truth) return fail(truth);
  const int width = GDALGetRasterXSize(truth->get()), height = GDALGetRasterYSize(truth->get());
  if (GDALGetRasterXSize(made->get()) != width || GDALGetRasterYSize(made->get()) != height ||
      GDALGetRasterCount(made->get()) != 3)
    return fail(Error::Kind::Damaged, fmt::format("{}: has {} x {} texels of {} bands, expected {} x {} of 3", map,
                                                  GDALGetRasterXSize(made->get()), GDALGetRasterYSize(made->get()),
                                                  GDALGetRasterCount(made->get()), width, height));
  MapCheck found;
  if (const auto levels = check_levels(map, *made, found); !levels) return fail(levels);

  // Windows along a lattice of rank 1
  double squares = 0;
  std::size_t count = 0;
  for (int i = 0; i < windows; ++i) {
    const int w = std::min(window, width), h = std::min(window, height);
    const int x = static_cast<int>(std::int64_t{width - w} * i / (windows - 1));
    const int y = static_cast<int>(std::int64_t{height - h} * (i * 27 % windows) / (windows - 1));
    const auto a = texels(*made, x, y, w, h), b = texels(*truth, x, y, w, h);
    if (!a) return fail(a.error().kind, map + ": " + a.error().message);
    if (!b) return fail(b.error().kind, source + ": " + b.error().message);
    for (std::size_t k = 0; k < a->size(); ++k) squares += std::pow((*a)[k] - (*b)[k], 2);
    count += a->size();
  }
  found.rms = std::sqrt(squares / static_cast<double>(count));
  if (lossless ? found.rms != 0 : found.rms > most_rms)
    return fail(Error::Kind::Damaged, fmt::format("{}: level 0 differs from the source by {:.2f} RMS, expected {}", map,
                                                  found.rms, lossless ? "the same texels" : "less than 10"));
  std::error_code problem;
  found.bytes = std::filesystem::file_size(map, problem);
  return found;
}

}  // namespace nadir::bench
