#include "ideal.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <thread>

namespace nadir::bench {
namespace {

/// Samples of the map across a pixel's sides.
struct Grid {
  int u, v;
};
Grid grid_of(const MapPoint& at) {
  const auto samples = [](double dx, double dy) {
    return std::max(8, static_cast<int>(std::ceil(2 * std::hypot(dx, dy))));
  };
  return {samples(at.dx_du, at.dy_du), samples(at.dx_dv, at.dy_dv)};
}

/// Adds the bilinear map at a place whose first texel has its centre at (0, 0).
void add_bilinear(const MapContent& map, double x, double y, double* sum) {
  const double left = std::floor(x), top = std::floor(y), fx = x - left, fy = y - top;
  const auto mask = static_cast<std::int64_t>(map.scene.side()) - 1;
  const std::int64_t x0 = static_cast<std::int64_t>(left) & mask, x1 = (x0 + 1) & mask,
                     y0 = static_cast<std::int64_t>(top) & mask, y1 = (y0 + 1) & mask;
  const int bands = map.scene.bands();
  const auto texel = [&](std::int64_t column, std::int64_t row) {
    return map.texels.data() + (row * (mask + 1) + column) * bands;
  };
  const float *a = texel(x0, y0), *b = texel(x1, y0), *c = texel(x0, y1), *d = texel(x1, y1);
  for (int k = 0; k < bands; ++k)
    sum[k] += (1 - fy) * ((1 - fx) * a[k] + fx * b[k]) + fy * ((1 - fx) * c[k] + fx * d[k]);
}

void mean_of_map(const View& view, const MapContent& map, double u, double v, double* out) {
  const auto& h = view.map_pixel_from_image_pixel;
  const Grid grid = grid_of(map_point(h, u, v));
  const int bands = map.scene.bands();
  std::fill_n(out, bands, 0.0);
  for (int j = 0; j < grid.v; ++j)
    for (int i = 0; i < grid.u; ++i) {
      const MapPoint at = map_point(h, u + (i + 0.5) / grid.u - 0.5, v + (j + 0.5) / grid.v - 0.5);
      add_bilinear(map, at.x, at.y, out);
    }
  for (int k = 0; k < bands; ++k) {
    out[k] /= static_cast<double>(grid.u) * grid.v;
    if (map.type != SampleType::f32) out[k] = std::floor(out[k] + 0.5);
  }
}

}  // namespace

MapContent MapContent::make(int side, int bands, SampleType type) {
  // Integers with room for what an interpolation overshoots
  const double most = type == SampleType::u8 ? 255 : type == SampleType::u16 ? 65535 : 1;
  KnownContent scene(side, bands, most * 8 / 255, most * 247 / 255);
  std::vector<float> texels = scene.texels(type != SampleType::f32);
  return {std::move(scene), std::move(texels), type};
}

std::vector<std::size_t> lattice(const View& view, double budget) {
  double samples = 0;  // of the whole frame, from a few of its pixels
  constexpr int probes = 16;
  for (int j = 0; j < probes; ++j)
    for (int i = 0; i < probes; ++i) {
      const Grid grid = grid_of(map_point(view.map_pixel_from_image_pixel, view.width * (i + 0.5) / probes,
                                          view.height * (j + 0.5) / probes));
      samples += static_cast<double>(grid.u) * grid.v;
    }
  samples *= static_cast<double>(view.width) * view.height / (probes * probes);
  int step = 1;  // odd: no step of a power of two, in which maps and blocks repeat
  while (samples / step / step > budget) step += 2;
  std::vector<std::size_t> pixels;
  for (int y = step / 2; y < view.height; y += step)
    for (int x = step / 2; x < view.width; x += step)
      pixels.push_back(static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width) +
                       static_cast<std::size_t>(x));
  return pixels;
}

std::vector<std::size_t> rectangle(const View& view, int x, int y, int width, int height) {
  std::vector<std::size_t> pixels;
  for (int row = y; row < y + height; ++row)
    for (int column = x; column < x + width; ++column)
      pixels.push_back(static_cast<std::size_t>(row) * static_cast<std::size_t>(view.width) +
                       static_cast<std::size_t>(column));
  return pixels;
}

Ideal ideal_of(const View& view, const MapContent& map, std::vector<std::size_t> pixels) {
  const auto bands = static_cast<std::size_t>(map.scene.bands()), width = static_cast<std::size_t>(view.width);
  Ideal ideal{view.width, map.scene.bands(), std::move(pixels), {}, {}};
  ideal.scene.resize(ideal.pixels.size() * bands);
  ideal.image.resize(ideal.pixels.size() * bands);
  const auto part = [&](std::size_t first, std::size_t step) {
    for (std::size_t i = first; i < ideal.pixels.size(); i += step) {
      const auto u = static_cast<double>(ideal.pixels[i] % width), v = static_cast<double>(ideal.pixels[i] / width);
      const MapPoint at = map_point(view.map_pixel_from_image_pixel, u, v);
      Eigen::Matrix2d sides;
      sides << at.dx_du, at.dx_dv, at.dy_du, at.dy_dv;
      const auto mean = map.scene.mean({at.x + 0.5, at.y + 0.5}, sides);
      std::copy_n(mean.begin(), bands, ideal.scene.begin() + static_cast<std::ptrdiff_t>(i * bands));
      mean_of_map(view, map, u, v, ideal.image.data() + i * bands);
    }
  };
  const std::size_t threads = std::max(1u, std::thread::hardware_concurrency());
  std::vector<std::jthread> others;
  for (std::size_t i = 1; i < threads; ++i) others.emplace_back(part, i, threads);
  part(0, threads);
  others.clear();
  return ideal;
}

double Deviation::psnr(double peak) const {
  return rms > 0 ? 20 * std::log10(peak / rms) : std::numeric_limits<double>::infinity();
}

double sample_at(std::span<const std::byte> frame, SampleType type, std::size_t i) {
  const auto read = [&](auto value) {
    std::memcpy(&value, frame.data() + i * sizeof value, sizeof value);
    return static_cast<double>(value);
  };
  return type == SampleType::u8    ? read(std::uint8_t{})
         : type == SampleType::u16 ? read(std::uint16_t{})
                                   : read(float{});
}

Deviation deviation(std::span<const std::byte> frame, SampleType type, const Ideal& ideal,
                    const std::vector<double>& values) {
  Deviation found;
  const auto bands = static_cast<std::size_t>(ideal.bands);
  double squares = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double error = std::abs(sample_at(frame, type, ideal.pixels[i / bands] * bands + i % bands) - values[i]);
    squares += error * error;
    found.max = std::max(found.max, error);
  }
  found.rms = std::sqrt(squares / static_cast<double>(std::max<std::size_t>(values.size(), 1)));
  return found;
}

}  // namespace nadir::bench
