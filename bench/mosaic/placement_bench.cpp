// What does it cost to lay a raster onto the grid of a map, and what does a tolerance buy?
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>

#include "nadir/mosaic/placement.h"

namespace {

using namespace nadir;
using namespace nadir::mosaic;

/// Target windows as the builder makes them: 1024 texels a side with all bands stay in the second-level cache's reach.
constexpr std::int32_t side = 1024;

Grid grid(const char* crs, double lon_deg, double lat_deg, double texel, std::int64_t size) {
  Grid g{geodesy::Projection::from_definition(crs).value(), crs, Eigen::Affine2d::Identity(), size, size};
  std::array<Eigen::Vector2d, 1> middle = {Eigen::Vector2d(geodesy::to_radians(lon_deg), geodesy::to_radians(lat_deg))};
  g.projection.crs_from_lon_lat(middle);
  g.crs_from_texel.linear() << texel, 0, 0, -texel;
  g.crs_from_texel.translation() = middle[0] + static_cast<double>(size) / 2 * texel * Eigen::Vector2d(-1, 1);
  return g;
}

/// Texels that hold their own place, which bilinear interpolation returns.
Block own_places(const Window& window) {
  const TexelType type{Sample::F64, 2, false, false, std::nullopt};
  Block block(type, window);
  for (std::int32_t y = window.y; y < window.y + window.height; ++y) {
    auto* row = reinterpret_cast<double*>(block.row(y));
    for (std::int32_t x = window.x; x < window.x + window.width; ++x) *row++ = x + 0.5, *row++ = y + 0.5;
  }
  return block;
}

/// Greatest distance from the exact mapping at every seventh texel of every seventh row, source texels.
double worst(const Grid& target, const Grid& source, const Placement& placement) {
  const TexelType type{Sample::F64, 2, false, false, std::nullopt};
  const Window window{0, 0, side, side};
  Block result(type, window);
  placement.resample(type, own_places(placement.needed(window)), result);
  double error = 0;
  for (std::int32_t y = 3; y < side; y += 7)
    for (std::int32_t x = 3; x < side; x += 7) {
      std::array<Eigen::Vector2d, 1> exact = {target.crs_from_texel * Eigen::Vector2d(x + 0.5, y + 0.5)};
      target.projection.lon_lat_from_crs(exact);
      source.projection.crs_from_lon_lat(exact);
      const auto* found = reinterpret_cast<const double*>(result.row(y)) + 2 * x;
      error =
          std::max(error, (source.crs_from_texel.inverse() * exact[0] - Eigen::Vector2d(found[0], found[1])).norm());
    }
  return error;
}

/// Error against cost: patches of the mapping alone, which needed() makes, a target 100 m a texel wide in the next
/// zone.
void BM_Tolerance(benchmark::State& state, const char* from, double texel) {
  const double tolerance = static_cast<double>(state.range(0)) / 1000;
  const Grid target = grid("EPSG:32614", -96, 45, 100, side), source = grid(from, -96, 45, texel, side * 2);
  const auto placement = Placement::create(target, source, {.tolerance_texels = tolerance}).value();
  const Window window{0, 0, side, side}, other{0, 0, 1, 1};
  const auto before = placement.exact_points();
  for (auto _ : state) {
    benchmark::DoNotOptimize(placement.needed(other));  // the last window's patches are kept
    benchmark::DoNotOptimize(placement.needed(window));
  }
  const double texels = static_cast<double>(state.iterations()) * side * side;
  state.counters["points_per_texel"] = static_cast<double>(placement.exact_points() - before) / texels;
  state.SetItemsProcessed(state.iterations() * side * side);  // texels
  state.counters["worst_texels"] = worst(target, source, placement);
}
BENCHMARK_CAPTURE(BM_Tolerance, utm, "EPSG:32615", 100.0)->Arg(1)->Arg(5)->Arg(10)->Arg(50)->Arg(100)->Arg(500);
BENCHMARK_CAPTURE(BM_Tolerance, degrees, "EPSG:4326", 0.001)->Arg(1)->Arg(5)->Arg(10)->Arg(50)->Arg(100)->Arg(500);

/// Texels of a map made from a source in the next UTM zone, `zoom` tenths of a source texel each.
void BM_Resample(benchmark::State& state, TexelType type, PlacementOptions options) {
  const double zoom = static_cast<double>(state.range(0)) / 10;
  const Grid target = grid("EPSG:32614", -96, 45, 10 * zoom, side), source = grid("EPSG:32615", -96, 45, 10, 8 * side);
  const auto placement = Placement::create(target, source, options).value();
  const Window window{0, 0, side, side};
  Block from(type, placement.needed(window)), to(type, window);
  const Window& w = from.window();
  for (std::int32_t y = w.y; y < w.y + w.height; ++y) {
    for (std::size_t i = 0; i < from.row_bytes(); ++i) {
      const auto pattern = static_cast<std::uint8_t>(1 + (i * 37 + static_cast<std::size_t>(y) * 11) % 200);
      from.row(y)[i] = static_cast<std::byte>(type.sample == Sample::F32 && i % 4 == 3 ? 0x41 : pattern);
    }
    if (type.mask) std::fill_n(from.valid_row(y), w.width, std::uint8_t{255});
    if (type.mask && y % 64 == 0) from.valid_row(y)[y % w.width] = 0;
  }
  for (auto _ : state) {
    placement.resample(type, from, to);
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * side * side);
}
const TexelType rgb{Sample::U8, 3, false, false, std::nullopt}, grey16{Sample::U16, 1, false, false, 0.0},
    masked{Sample::U8, 3, false, true, std::nullopt}, rgba{Sample::U8, 4, true, false, std::nullopt},
    f32{Sample::F32, 1, false, false, std::nullopt};
BENCHMARK_CAPTURE(BM_Resample, rgb_nearest, rgb, PlacementOptions{.interpolation = Interpolation::Nearest})->Arg(10);
BENCHMARK_CAPTURE(BM_Resample, rgb_bilinear, rgb, PlacementOptions{})->Arg(10)->Arg(20);
BENCHMARK_CAPTURE(BM_Resample, rgb_cubic, rgb, PlacementOptions{.interpolation = Interpolation::Cubic})->Arg(10);
BENCHMARK_CAPTURE(BM_Resample, masked_bilinear, masked, PlacementOptions{})->Arg(10);
BENCHMARK_CAPTURE(BM_Resample, transparent_bilinear, rgba, PlacementOptions{})->Arg(10);  // no texel opaque
BENCHMARK_CAPTURE(BM_Resample, u16_nodata_bilinear, grey16, PlacementOptions{})->Arg(10);
BENCHMARK_CAPTURE(BM_Resample, f32_bilinear, f32, PlacementOptions{})->Arg(10);
BENCHMARK_CAPTURE(BM_Resample, f32_decibels, f32, PlacementOptions{.power = true})->Arg(10);

}  // namespace
