#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "nadir/render/sample_block.h"
#include "sample_with.h"
#include "support/level_in_memory.h"

namespace nadir::test {

/// A map of three levels in memory, and a function of it: what a texel is.
struct MapInMemory {
  render::SampleFormat format;
  int width, height;  // of level 0
  bool masked, around;
  std::uint32_t seed;

  MapInMemory(const render::SampleFormat& of, int level_width, int level_height, bool with_mask, bool goes_around,
              std::uint32_t its_seed)
      : format(of), width(level_width), height(level_height), masked(with_mask), around(goes_around), seed(its_seed) {
    for (int k = 0; k < 3; ++k) {
      const int w = std::max(width >> k, 1), h = std::max(height >> k, 1);
      levels.push_back(std::make_unique<LevelInMemory>(
          format.type, format.bands, w, h,
          [this, k](int col, int row, int band) {
            return valid(k, col, row) ? texel(k, col, row, band) : std::numeric_limits<double>::quiet_NaN();
          },
          [this, k](int col, int row) { return valid(k, col, row); }));
      windows.push_back(levels.back()->window(k, 1 << k, around));
    }
  }

  std::uint32_t noise(int level, int col, int row, int band) const {
    std::uint32_t x = seed + static_cast<std::uint32_t>(level * 7919 + col * 65599 + row * 2654435 + band * 97);
    x = (x ^ (x >> 16)) * 0x45d9f3bu;
    x = (x ^ (x >> 15)) * 0x2c1b3c6du;
    return x ^ (x >> 16);
  }
  /// Whole numbers, extremes among them; of floats, fractions too.
  double texel(int level, int col, int row, int band) const {
    const std::uint32_t n = noise(level, col, row, band);
    const auto of = [&](double low, double high) {
      if (n % 4 == 0) return n % 8 == 0 ? low : high;
      return std::floor(low + (high - low) * (n >> 8) / (1 << 24));
    };
    switch (format.type) {
      case tile::SampleType::Int16:
        return of(-32768, 32767);
      case tile::SampleType::UInt16:
        return of(0, 65535);
      case tile::SampleType::Float32:
        return static_cast<float>(of(1, 1000) / 7);
      case tile::SampleType::UInt8:
        break;
    }
    return of(0, 255);
  }
  bool valid(int level, int col, int row) const { return !masked || noise(level, col / 3, row / 3, 1000) % 5 != 0; }

  std::vector<std::unique_ptr<LevelInMemory>> levels;
  std::vector<render::LevelWindow> windows;
};

/// A block on a map, with what it refers to.
struct RandomBlock {
  render::BlockSampling sampling;
  std::vector<Eigen::Vector2d> texels;

  RandomBlock(const MapInMemory& map, render::Interpolation interpolation, std::mt19937& random) {
    const auto uniform = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    const auto whole = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
    render::BlockSampling& s = sampling;
    s.width = whole(0, 3) == 0 ? 1 : whole(1, 80);
    s.height = whole(0, 3) == 0 ? 1 : whole(1, 20);
    s.map_width = map.around ? 5.0 * map.width : map.width;
    s.map_height = map.height;
    s.interpolation = interpolation;
    s.level_blend.band = std::array{1.0, 0.25, 0.0}[static_cast<std::size_t>(whole(0, 2))];
    if (interpolation == render::Interpolation::Bilinear) {
      s.samples_x = whole(1, 3);
      s.samples_y = whole(0, 1) == 0 ? s.samples_x : 1;
      for (double& level : s.level_at_corner) level = uniform(0, 2.2);
      if (whole(0, 2) == 0) s.level_at_corner.fill(whole(0, 2));
    } else {
      s.level_at_corner.fill(whole(0, 2));
    }
    s.levels = map.windows;

    // Some blocks lie partly off the map, or wholly
    const double scale =
        std::exp2(uniform(-2, s.width * s.height < 50 ? 6 : 2.5));  // pixels that need many patches too
    Eigen::Matrix2d linear = scale * Eigen::Rotation2Dd(uniform(-3, 3)).toRotationMatrix();
    linear.col(0) *= uniform(0.5, 2);
    const Eigen::Vector2d extent = linear.cwiseAbs() * Eigen::Vector2d(s.width, s.height);
    Eigen::Vector2d corner(uniform(-extent.x(), map.width + extent.x()), uniform(-extent.y(), map.height + extent.y()));
    if (map.around) corner.x() = 2.0 * map.width + uniform(-extent.x(), map.width);
    const int kind = whole(0, 2);
    Eigen::Matrix3d h = Eigen::Matrix3d::Identity();
    h.topLeftCorner<2, 2>() = linear;
    h.row(2) << uniform(-0.3, 0.3) / s.width, uniform(-0.3, 0.3) / s.height, 1;
    s.texel_origin = corner;
    if (kind == 0) {
      s.texel_from_image = h;
    } else if (kind == 1) {
      std::array<Eigen::Vector2d, 9> lattice;
      for (int i = 0; i < 9; ++i)
        lattice[static_cast<std::size_t>(i)] =
            linear * Eigen::Vector2d(s.width * (i % 3) / 2.0, s.height * (i / 3) / 2.0) +
            0.1 * Eigen::Vector2d(uniform(-1, 1), uniform(-1, 1));
      s.biquadratic.emplace(s.width, s.height, lattice);
    } else {
      for (int y = 0; y < s.height; ++y)
        for (int x = 0; x < s.width; ++x)
          texels.push_back(whole(0, 9) == 0 ? Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN())
                                            : Eigen::Vector2d(corner + linear * Eigen::Vector2d(x + 0.5, y + 0.5)));
      s.jacobian = linear;
      s.texel_origin.setZero();
      s.texels = texels;
    }
  }
  RandomBlock(const RandomBlock&) = delete;
  RandomBlock& operator=(const RandomBlock&) = delete;
};

/// A block's pixels: bytes of samples, then of validity.
struct Pixels {
  std::vector<std::byte> samples;
  std::vector<std::uint8_t> validity;
  friend bool operator==(const Pixels&, const Pixels&) = default;
};

/// With room around the block in the frame, which must stay as it was.
inline Pixels sample(const render::Kernels& kernels, const render::BlockSampling& block,
                     const render::SampleFormat& format) {
  const std::size_t stride = static_cast<std::size_t>(block.width) + 3,
                    rows = static_cast<std::size_t>(block.height) + 1;
  const std::size_t pixel = static_cast<std::size_t>(format.bands) * tile::size_bytes(format.type);
  Pixels pixels{std::vector<std::byte>(stride * rows * pixel, std::byte{0x77}),
                std::vector<std::uint8_t>(stride * rows, 0x77)};
  const render::BlockTarget target{block.levels, pixels.samples.data(), pixels.validity.data()};
  render::sample_block_with(kernels, block, format, {&target, 1}, stride);
  return pixels;
}

}  // namespace nadir::test
