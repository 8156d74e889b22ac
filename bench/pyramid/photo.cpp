#include "photo.h"

#include <cpl_conv.h>
#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <thread>
#include <vector>

#include "nadir/base/files.h"
#include "nadir/base/text.h"

namespace nadir::bench {
namespace {

namespace fs = std::filesystem;

/// A well-mixed function of its arguments. Source: Steele, Lea and Flood, Fast Splittable Pseudorandom Number
/// Generators, 2014: the finalizer of SplitMix64.
std::uint64_t mixed(std::uint64_t a, std::uint64_t b, std::uint64_t c) {
  std::uint64_t z = a * 0x9e3779b97f4a7c15U + b * 0xbf58476d1ce4e5b9U + c * 0x94d049bb133111ebU;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
  return z ^ (z >> 31);
}

std::uint64_t mixed(std::uint64_t seed, std::int64_t x, std::int64_t y) {
  return mixed(seed, static_cast<std::uint64_t>(x), static_cast<std::uint64_t>(y));
}

/// Byte `i` of a mixed number as a number in [-1, 1).
float signed_byte(std::uint64_t bits, int i) {
  return static_cast<float>(static_cast<int>((bits >> (8 * i)) & 0xff) - 128) * (1.0F / 128);
}

float smooth(float t) { return t * t * (3 - 2 * t); }

/// Hills as values at the corners of square cells, smoothly blended, summed over sizes of cells.
struct Octave {
  int cell;         // side, texels: a power of two
  float amplitude;  // levels of 255
};
constexpr std::array<Octave, 9> octaves = {
    {{1024, 26}, {512, 18}, {256, 12}, {128, 8}, {64, 6}, {32, 4.5F}, {16, 7}, {8, 9}, {4, 9}}};

constexpr std::int64_t band_height = 256, parcel_pitch = 384, road_width = 7;
constexpr float furrow_amplitude = 4, road_grey = 150;
constexpr float shared_noise = 17, colour_noise = 1.2F;  // extremes before they are averaged over 2 x 2 texels

/// What lies on a row between two borders of fields.
struct Parcel {
  std::int64_t begin, end;
  std::array<float, 3> tint;
  float furrow_x, furrow_y;  // periods a texel
  bool road_at_begin;
};

/// Fields of the row's band, which has its own borders.
std::vector<Parcel> parcels_of(std::uint64_t seed, std::int64_t y, std::int64_t width) {
  std::vector<Parcel> parcels;
  const std::int64_t band = y / band_height;
  const auto border = [&](std::int64_t i) {
    return i * parcel_pitch + static_cast<std::int64_t>(mixed(seed + 1, i, band) % (parcel_pitch / 2));
  };
  for (std::int64_t i = -1; border(i) < width; ++i) {
    const std::uint64_t bits = mixed(seed + 2, i, band);
    const float green = 22 * signed_byte(bits, 0), dry = 18 * signed_byte(bits, 1);
    parcels.push_back({std::max<std::int64_t>(border(i), 0),
                       std::min(border(i + 1), width),
                       {dry - 8, green + 6, -dry / 2 - 16},
                       signed_byte(bits, 2) / 8,
                       signed_byte(bits, 3) / 8,
                       (bits >> 60) < 5 && border(i) >= 0});
  }
  return parcels;
}

/// Makes one row after the other.
class RowMaker {
 public:
  RowMaker(std::uint64_t seed, std::int64_t width)
      : seed_(seed), width_(width), light_(static_cast<std::size_t>(width)) {
    for (auto* noise : {&noise_, &next_noise_}) noise->resize(static_cast<std::size_t>(width) + 1);
    for (std::size_t o = 0; o < octaves.size(); ++o) {
      const int cell = octaves[o].cell;
      for (int k = 0; k < cell; ++k) blends_[o].push_back(smooth(static_cast<float>(k) / static_cast<float>(cell)));
    }
  }

  void make(std::int64_t y, std::uint8_t* out) {
    if (y != noise_row_) sense(y, noise_);
    sense(y + 1, next_noise_);
    shade(y);
    for (const Parcel& parcel : parcels_of(seed_, y, width_)) fill(parcel, y, out);
    std::swap(noise_, next_noise_);
    noise_row_ = y + 1;
  }

 private:
  using Noise = std::array<float, 3>;

  /// Noise of the sensor's own texels, part of which colours share.
  void sense(std::int64_t y, std::vector<Noise>& noise) const {
    for (std::size_t x = 0; x < noise.size(); ++x) {
      const std::uint64_t bits = mixed(seed_ + 3, static_cast<std::int64_t>(x), y);
      const float shared = shared_noise * (signed_byte(bits, 0) + signed_byte(bits, 1));
      for (std::size_t c = 0; c < 3; ++c)
        noise[x][c] = shared + colour_noise * (signed_byte(bits, 2 + 2 * static_cast<int>(c)) +
                                               signed_byte(bits, 3 + 2 * static_cast<int>(c % 2)));
    }
  }

  /// Hills of the row.
  void shade(std::int64_t y) {
    std::fill(light_.begin(), light_.end(), 0.0F);
    for (std::size_t o = 0; o < octaves.size(); ++o) {
      const std::int64_t cell = octaves[o].cell, j = y / cell;
      const float blend = blends_[o][static_cast<std::size_t>(y % cell)];
      const auto corner = [&](std::int64_t i) {
        const float above = signed_byte(mixed(seed_ + 10 + o, i, j), 0);
        const float below = signed_byte(mixed(seed_ + 10 + o, i, j + 1), 0);
        return octaves[o].amplitude * (above + (below - above) * blend);
      };
      float left = corner(0);
      for (std::int64_t i = 0; i * cell < width_; ++i) {
        const float right = corner(i + 1);
        const std::int64_t n = std::min(cell, width_ - i * cell);
        float* light = light_.data() + i * cell;
        const float* weights = blends_[o].data();
        for (std::int64_t k = 0; k < n; ++k) light[k] += left + (right - left) * weights[k];
        left = right;
      }
    }
  }

  void fill(const Parcel& parcel, std::int64_t y, std::uint8_t* out) const {
    const std::int64_t in_band = y % band_height;
    for (std::int64_t x = parcel.begin; x < parcel.end; ++x) {
      const auto at = static_cast<std::size_t>(x);
      const bool road = in_band < road_width || (parcel.road_at_begin && x - parcel.begin < road_width);
      float phase = parcel.furrow_x * static_cast<float>(x % 4096) + parcel.furrow_y * static_cast<float>(in_band);
      phase -= std::floor(phase);
      const float furrow = furrow_amplitude * (phase < 0.5F ? 4 * phase - 1 : 3 - 4 * phase);
      const float light = road ? road_grey + light_[at] / 8 : 112 + light_[at] + furrow;
      for (std::size_t c = 0; c < 3; ++c) {
        const float noise = (noise_[at][c] + noise_[at + 1][c] + next_noise_[at][c] + next_noise_[at + 1][c]) * 0.25F;
        const float value = light + (road ? 0 : parcel.tint[c]) + noise;
        out[3 * at + c] = static_cast<std::uint8_t>(std::clamp(value + 0.5F, 0.0F, 255.0F));
      }
    }
  }

  std::uint64_t seed_;
  std::int64_t width_, noise_row_ = -1;
  std::vector<float> light_;
  std::vector<Noise> noise_, next_noise_;
  std::array<std::vector<float>, octaves.size()> blends_;
};

struct CloseDataset {
  void operator()(GDALDatasetH dataset) const noexcept { GDALClose(dataset); }
};
using Dataset = std::unique_ptr<void, CloseDataset>;

Result<void> write_photo(const Photo& photo, const fs::path& path, int threads) {
  const auto failed = [&] {
    return fail(Error::Kind::Io, fmt::format("{}: GDAL cannot write it: {}", path.string(), CPLGetLastErrorMsg()));
  };
  const auto side = static_cast<int>(photo.side);
  std::array<std::string, 3> words = {"PHOTOMETRIC=RGB", "INTERLEAVE=PIXEL", "BIGTIFF=IF_SAFER"};
  std::array<char*, 4> list = {words[0].data(), words[1].data(), words[2].data(), nullptr};
  const Dataset dataset(GDALCreate(GDALGetDriverByName("GTiff"), path.c_str(), side, side, 3, GDT_Byte, list.data()));
  if (!dataset) return failed();
  std::array<double, 6> place = {500'000, 1, 0, 5'400'000, 0, -1};
  GDALSetGeoTransform(dataset.get(), place.data());
  OGRSpatialReference crs;
  crs.importFromEPSG(32633);
  char* wkt = nullptr;
  crs.exportToWkt(&wkt);
  GDALSetProjection(dataset.get(), wkt);
  CPLFree(wkt);

  // Chunks of rows: made side by side, written one after the other
  constexpr std::int64_t rows = 64;
  const auto row_bytes = static_cast<std::size_t>(photo.side) * 3;
  std::vector<std::uint8_t> chunk(row_bytes * rows * static_cast<std::size_t>(threads));
  for (std::int64_t y = 0; y < photo.side; y += rows * threads) {
    const std::int64_t count = std::min(rows * threads, photo.side - y);
    std::vector<std::jthread> workers;
    for (std::int64_t first = 0; first < count; first += rows)
      workers.emplace_back([&, first] {
        photo_rows(photo.seed, y + first, std::min(rows, count - first), photo.side,
                   chunk.data() + static_cast<std::size_t>(first) * row_bytes);
      });
    workers.clear();
    if (GDALDatasetRasterIO(dataset.get(), GF_Write, 0, static_cast<int>(y), side, static_cast<int>(count),
                            chunk.data(), side, static_cast<int>(count), GDT_Byte, 3, nullptr, 3,
                            static_cast<int>(row_bytes), 1) != CE_None)
      return failed();
  }
  CPLErrorReset();
  GDALFlushCache(dataset.get());
  return CPLGetLastErrorType() >= CE_Failure ? Result<void>(failed()) : Result<void>{};
}

}  // namespace

void photo_rows(std::uint64_t seed, std::int64_t first, std::int64_t count, std::int64_t width, std::uint8_t* out) {
  RowMaker maker(seed, width);
  for (std::int64_t y = first; y < first + count; ++y) maker.make(y, out + (y - first) * width * 3);
}

Result<void> expect_free(const fs::path& folder, std::uint64_t bytes) {
  std::error_code problem;
  const auto space = fs::space(folder, problem);
  if (problem) return fail(Error::Kind::Io, fmt::format("{}: {}", folder.string(), problem.message()));
  if (space.available < bytes)
    return fail(Error::Kind::Io,
                fmt::format("{}: needs {} free, there are {}; set TMPDIR or --keep to a larger disk, or "
                            "take a smaller --side",
                            folder.string(), format_bytes(bytes), format_bytes(space.available)));
  return {};
}

Result<fs::path> photo_file(const Photo& photo, const fs::path& folder, int threads) {
  const fs::path path = folder / fmt::format("photo_{}_seed{}.tif", photo.side, photo.seed);
  std::error_code problem;
  if (fs::exists(path, problem)) return path;
  fs::create_directories(folder, problem);
  const auto bytes = static_cast<std::uint64_t>(photo.side) * static_cast<std::uint64_t>(photo.side) * 3;
  if (const auto room = expect_free(folder, bytes + bytes / 16); !room) return fail(room);
  GDALAllRegister();
  const fs::path unfinished = temporary_name(path);
  if (const auto written = write_photo(photo, unfinished, threads); !written) {
    fs::remove(unfinished, problem);
    return fail(written);
  }
  if (const auto moved = move_into_place(unfinished, path); !moved) return fail(moved);
  return path;
}

}  // namespace nadir::bench
