#include "reduce.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "nadir/base/progress.h"

namespace nadir::pyramid {
namespace {

/// A level to read from or write to: its samples, and its mask band where the mosaic has one.
struct Level {
  GDALDataset* samples = nullptr;
  GDALRasterBand* mask = nullptr;
};

struct Rectangle {
  int x = 0, y = 0, width = 0, height = 0;
  std::size_t area() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
};

/// How a band's stored values are averaged and written.
struct BandRule {
  Mean kind = Mean::AsStored;
  double scale = 1, offset = 0;  // physical = stored * scale + offset
  std::optional<double> nodata;
  bool alpha = false;
  bool integral = false;

  double average(std::span<double> values, std::span<const double> weights) const {
    if (values.empty()) return nodata.value_or(integral ? 0 : std::numeric_limits<double>::quiet_NaN());
    if (kind == Mean::Power)
      for (double& v : values) v = v * scale + offset;
    double value = kind == Mean::Power ? (mean_of_power(values, weights) - offset) / scale : mean(values, weights);
    if (!integral) return value;
    const double rounded = std::round(value);
    if (!nodata || rounded != *nodata) return rounded;
    return value < rounded ? rounded - 1 : rounded + 1;  // a hole would be wrong by more than one step
  }
};

BandRule rule_of(GDALRasterBand& band, Mean kind) {
  BandRule rule;
  rule.alpha = band.GetColorInterpretation() == GCI_AlphaBand;
  rule.kind = rule.alpha ? Mean::AsStored : kind;
  rule.scale = band.GetScale();
  rule.offset = band.GetOffset();
  rule.integral = GDALDataTypeIsInteger(band.GetRasterDataType());
  int there = 0;
  const double nodata = band.GetNoDataValue(&there);
  if (there) rule.nodata = nodata;
  return rule;
}

CPLErr read(GDALRasterBand& band, const Rectangle& r, void* to, GDALDataType type) {
  return band.RasterIO(GF_Read, r.x, r.y, r.width, r.height, to, r.width, r.height, type, 0, 0, nullptr);
}
CPLErr write(GDALRasterBand& band, const Rectangle& r, void* from, GDALDataType type) {
  return band.RasterIO(GF_Write, r.x, r.y, r.width, r.height, from, r.width, r.height, type, 0, 0, nullptr);
}

/// The rectangle of the finer level that covers `r`.
Rectangle covered(const Rectangle& r, const std::vector<Cover>& columns, const std::vector<Cover>& rows) {
  const Cover &left = columns[static_cast<std::size_t>(r.x)],
              &right = columns[static_cast<std::size_t>(r.x + r.width - 1)];
  const Cover &top = rows[static_cast<std::size_t>(r.y)], &bottom = rows[static_cast<std::size_t>(r.y + r.height - 1)];
  return {left.first, top.first, right.first + right.count - left.first, bottom.first + bottom.count - top.first};
}

/// Calls `each(i, values, weights)` for every sample i of `to`, with the valid samples of `from` that it covers.
template <class Each>
void for_each_sample(const Rectangle& to, const Rectangle& from, const std::vector<Cover>& columns,
                     const std::vector<Cover>& rows, const std::vector<double>& samples,
                     const std::vector<std::uint8_t>& valid, Each&& each) {
  std::array<double, 9> values, weights;
  std::size_t i = 0;
  for (int y = to.y; y < to.y + to.height; ++y) {
    const Cover& row = rows[static_cast<std::size_t>(y)];
    for (int x = to.x; x < to.x + to.width; ++x, ++i) {
      const Cover& column = columns[static_cast<std::size_t>(x)];
      std::size_t count = 0;
      for (int dy = 0; dy < row.count; ++dy) {
        for (int dx = 0; dx < column.count; ++dx) {
          const auto at = static_cast<std::size_t>(row.first + dy - from.y) * static_cast<std::size_t>(from.width) +
                          static_cast<std::size_t>(column.first + dx - from.x);
          if (valid[at] < 128 || !std::isfinite(samples[at])) continue;
          values[count] = samples[at];
          weights[count++] =
              static_cast<double>(row.parts[static_cast<std::size_t>(dy)]) * column.parts[static_cast<std::size_t>(dx)];
        }
      }
      each(i, std::span(values.data(), count), std::span<const double>(weights.data(), count));
    }
  }
}

/// Reduces what the rectangle `to` of the coarser level covers. False where GDAL cannot read or write.
bool reduce_rectangle(const Level& fine, const Level& coarse, const Rectangle& to, const std::vector<Cover>& columns,
                      const std::vector<Cover>& rows, const std::vector<BandRule>& rules) {
  const Rectangle from = covered(to, columns, rows);
  std::vector<double> samples(from.area()), reduced(to.area());
  std::vector<std::uint8_t> valid(from.area()), any_valid(to.area(), 0);
  for (std::size_t b = 0; b < rules.size(); ++b) {
    const BandRule& rule = rules[b];
    GDALRasterBand& band = *fine.samples->GetRasterBand(static_cast<int>(b) + 1);
    GDALRasterBand& mask = fine.mask ? *fine.mask : *band.GetMaskBand();
    if (read(band, from, samples.data(), GDT_Float64) != CE_None) return false;
    if (rule.alpha)
      std::fill(valid.begin(), valid.end(), std::uint8_t{255});
    else if (read(mask, from, valid.data(), GDT_Byte) != CE_None)
      return false;

    for_each_sample(to, from, columns, rows, samples, valid,
                    [&](std::size_t i, std::span<double> values, std::span<const double> weights) {
                      if (!values.empty()) any_valid[i] = 255;
                      reduced[i] = rule.average(values, weights);
                    });
    if (write(*coarse.samples->GetRasterBand(static_cast<int>(b) + 1), to, reduced.data(), GDT_Float64) != CE_None)
      return false;
  }
  return !coarse.mask || write(*coarse.mask, to, any_valid.data(), GDT_Byte) == CE_None;
}

/// An empty tiled file for one level.
gdal::Dataset create_level(const std::filesystem::path& path, const LevelSize& size, int bands, GDALDataType type,
                           int tile_size) {
  const std::string side = std::to_string(tile_size);
  CPLStringList creation;
  creation.SetNameValue("TILED", "YES");
  creation.SetNameValue("BLOCKXSIZE", side.c_str());
  creation.SetNameValue("BLOCKYSIZE", side.c_str());
  creation.SetNameValue("BIGTIFF", "IF_SAFER");
  creation.SetNameValue("INTERLEAVE", "BAND");
  creation.SetNameValue("PHOTOMETRIC", "MINISBLACK");
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
  return gdal::Dataset{driver->Create(path.c_str(), size.width, size.height, bands, type, creation.List())};
}

}  // namespace

std::vector<Cover> covers(int fine, int coarse) {
  std::vector<Cover> all(static_cast<std::size_t>(coarse));
  for (int i = 0; i < coarse; ++i) {
    // In units of 1 / coarse of a fine sample both kinds of borders are whole numbers.
    const std::int64_t begin = std::int64_t{i} * fine, end = begin + fine;
    Cover& cover = all[static_cast<std::size_t>(i)];
    cover.first = static_cast<int>(begin / coarse);
    for (std::int64_t j = cover.first; j * coarse < end; ++j)
      cover.parts[static_cast<std::size_t>(cover.count++)] =
          static_cast<int>(std::min((j + 1) * coarse, end) - std::max(j * coarse, begin));
  }
  return all;
}

double mean(std::span<const double> values, std::span<const double> weights) {
  double sum = 0, total = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    sum += weights[i] * values[i];
    total += weights[i];
  }
  return sum / total;
}

double mean_of_power(std::span<const double> decibels, std::span<const double> weights) {
  const double greatest = *std::max_element(decibels.begin(), decibels.end());
  double sum = 0, total = 0;
  for (std::size_t i = 0; i < decibels.size(); ++i) {
    sum += weights[i] * std::pow(10.0, (decibels[i] - greatest) / 10);
    total += weights[i];
  }
  return greatest + 10 * std::log10(sum / total);
}

std::vector<LevelSize> level_sizes(int width, int height) {
  std::vector<LevelSize> sizes;
  while (std::max(width, height) > coarsest_texels) {
    width -= width / 2;
    height -= height / 2;
    sizes.push_back({width, height});
  }
  return sizes;
}

Result<std::vector<std::filesystem::path>> reduce(GDALDataset& full, const Mosaic& mosaic, Mean kind, int tile_size,
                                                  const Scratch& scratch, bool show_progress) {
  const std::vector<LevelSize> sizes = level_sizes(mosaic.width, mosaic.height);
  std::vector<BandRule> rules;
  for (int b = 1; b <= mosaic.band_count; ++b) rules.push_back(rule_of(*full.GetRasterBand(b), kind));
  const auto tiles_of = [&](const LevelSize& s) {
    return (std::int64_t{s.width} + tile_size - 1) / tile_size * ((std::int64_t{s.height} + tile_size - 1) / tile_size);
  };
  std::int64_t tiles = 0;
  for (const LevelSize& size : sizes) tiles += tiles_of(size);
  Progress progress("reducing", "tiles", tiles, show_progress);

  const gdal::GdalMessages messages;
  const auto broken = [&](std::size_t level) {
    return fail(Error::Kind::Io, fmt::format("{}: level {} cannot be made: {}; is a source damaged, or the disk full?",
                                             scratch.output().string(), level, messages.first()));
  };
  std::vector<std::filesystem::path> files;
  gdal::Dataset fine_samples;  // of level 1 on; level 0 is the caller's
  Level fine{&full, mosaic.mask ? full.GetRasterBand(1)->GetMaskBand() : nullptr};
  LevelSize fine_size{mosaic.width, mosaic.height};
  for (const LevelSize& size : sizes) {
    const std::size_t number = files.size() + 1;
    files.push_back(scratch.file(fmt::format("level{}.tif", number)));
    gdal::Dataset samples = create_level(files.back(), size, mosaic.band_count, mosaic.sources.front().type, tile_size);
    if (!samples || (mosaic.mask && samples->CreateMaskBand(GMF_PER_DATASET) != CE_None)) return broken(number);
    for (int b = 1; b <= mosaic.band_count; ++b) {
      const BandRule& rule = rules[static_cast<std::size_t>(b) - 1];
      if (rule.nodata) samples->GetRasterBand(b)->SetNoDataValue(*rule.nodata);
      if (rule.alpha) samples->GetRasterBand(b)->SetColorInterpretation(GCI_AlphaBand);
    }

    // Tile by tile, so that memory does not grow with the map.
    const Level coarse{samples.get(), mosaic.mask ? samples->GetRasterBand(1)->GetMaskBand() : nullptr};
    const std::vector<Cover> columns = covers(fine_size.width, size.width),
                             rows = covers(fine_size.height, size.height);
    for (int y = 0; y < size.height; y += tile_size) {
      for (int x = 0; x < size.width; x += tile_size) {
        const Rectangle to{x, y, std::min(tile_size, size.width - x), std::min(tile_size, size.height - y)};
        if (!reduce_rectangle(fine, coarse, to, columns, rows, rules)) return broken(number);
        progress.advance();
      }
    }
    samples->FlushCache();
    if (messages.failed()) return broken(number);
    fine_samples = std::move(samples);
    fine = coarse;
    fine_size = size;
  }
  fine_samples.reset();  // the last of it is written here, and may fail here
  if (messages.failed()) return broken(files.size());
  return files;
}

}  // namespace nadir::pyramid
