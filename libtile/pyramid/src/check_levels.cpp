#include "check_levels.h"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <thread>

#include "nadir/base/progress.h"
#include "nadir/mosaic/validity.h"
#include "taps.h"

namespace nadir::pyramid {
namespace {

using mosaic::samples_at, mosaic::Source, mosaic::valid_at;

/// How two windows of texels differ.
struct Difference {
  double squares = 0, greatest = 0;
  std::int64_t samples = 0, texels = 0;  // texels: that differ by more than they may
  void add(const Difference& other) {
    squares += other.squares;
    greatest = std::max(greatest, other.greatest);
    samples += other.samples;
    texels += other.texels;
  }
};

template <class T>
double difference_of(T a, T b) {
  if (a == b) return 0;
  if constexpr (std::is_floating_point_v<T>) {
    if (std::isnan(a) && std::isnan(b)) return 0;
    if (!std::isfinite(a) || !std::isfinite(b)) return std::numeric_limits<double>::infinity();
  }
  return std::abs(static_cast<double>(a) - static_cast<double>(b));
}

/// The most that samples may differ by, rounding of integers included.
double most_allowed(const LevelBound& bound, const TexelType& type) {
  switch (bound.kind) {
    case LevelBound::Kind::Same:
      return 0;
    case LevelBound::Kind::Greatest:
      return bound.value + (type.sample == tiff::Sample::F32 || type.sample == tiff::Sample::F64 ? 0 : 1);
    default:
      return std::numeric_limits<double>::infinity();
  }
}

template <class T>
class Comparison {
 public:
  Comparison(const TexelType& type, const LevelBound& bound, const Block& stored, const Block& made)
      : type_(type),
        validity_(type),
        exact_(bound.kind == LevelBound::Kind::Same),
        brightness_(bound.kind == LevelBound::Kind::RmsOfBrightness && type.bands == 3),
        most_(most_allowed(bound, type)),
        stored_(stored),
        made_(made) {}

  Difference of(const Window& window) const {
    Difference found;
    for (std::int32_t y = window.y; y < window.y + window.height; ++y) {
      const T *a = samples_at<T>(stored_, type_, window.x, y), *b = samples_at<T>(made_, type_, window.x, y);
      const std::uint8_t *va = valid_at(stored_, window.x, y), *vb = valid_at(made_, window.x, y);
      for (std::int32_t x = 0; x < window.width; ++x, a += type_.bands, b += type_.bands)
        add_texel(a, b, va ? va + x : nullptr, vb ? vb + x : nullptr, found);
    }
    return found;
  }

 private:
  void add_texel(const T* a, const T* b, const std::uint8_t* va, const std::uint8_t* vb, Difference& found) const {
    const bool valid = validity_.texel(a, va), made_valid = validity_.texel(b, vb);
    bool differs = valid != made_valid;
    const bool looked_at = exact_ || (valid && made_valid);
    if (brightness_ && looked_at) {
      const auto brightness = [](const T* s) {
        return 0.299 * static_cast<double>(s[0]) + 0.587 * static_cast<double>(s[1]) +
               0.114 * static_cast<double>(s[2]);
      };
      add(std::abs(brightness(a) - brightness(b)), differs, found);
    } else if (looked_at) {
      for (int band = 0; band < type_.bands; ++band) add(difference_of(a[band], b[band]), differs, found);
    }
    found.texels += differs ? 1 : 0;
  }

  void add(double d, bool& differs, Difference& found) const {
    differs |= d > most_;
    ++found.samples;
    if (std::isfinite(d)) found.squares += d * d;
    found.greatest = std::max(found.greatest, d);
  }

  const TexelType& type_;
  const mosaic::Validity<T> validity_;
  const bool exact_, brightness_;
  const double most_;
  const Block& stored_;
  const Block& made_;
};

Window clipped(const Window& window, const LevelSize& size) {
  const std::int32_t x = std::min(window.x, size.width), y = std::min(window.y, size.height);
  return {x, y, std::min(window.width, size.width - x), std::min(window.height, size.height - y)};
}

class LevelChecks {
 public:
  LevelChecks(const LevelsToCheck& levels, CheckReport& report, FaultList& faults)
      : map_(levels),
        levels_(levels.sources),
        type_(levels.type),
        bound_(levels.bound),
        report_(report),
        faults_(faults) {}

  void run(const CheckOptions& options) {
    const int threads =
        options.threads > 0 ? options.threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    std::int64_t total = 0;
    for (std::size_t k = 0; k < levels_.size(); ++k) total += static_cast<std::int64_t>(windows(k).size());
    Progress progress("checking", "windows", total, options.show_progress);
    const tbb::global_control allow(
        tbb::global_control::max_allowed_parallelism,
        static_cast<std::size_t>(std::max(threads, tbb::this_task_arena::max_concurrency())));
    tbb::task_arena arena(threads);
    for (std::size_t k = 0; k < levels_.size(); ++k) {
      const std::vector<Window> all = windows(k);
      std::vector<Difference> found(all.size());
      std::vector<std::int64_t> damaged(all.size());
      arena.execute([&] {
        tbb::parallel_for(std::size_t{0}, all.size(), [&](std::size_t i) {
          check_window(k, all[i], found[i], damaged[i]);
          progress.advance();
        });
      });
      LevelCheck& level = report_.levels[k];
      Difference sum;
      for (std::size_t i = 0; i < all.size(); ++i) {
        sum.add(found[i]);
        level.damaged_tiles += damaged[i];
      }
      judge(static_cast<int>(k), sum);
    }
  }

 private:
  LevelSize size(std::size_t level) const {
    return {static_cast<std::int32_t>(levels_[level]->width()), static_cast<std::int32_t>(levels_[level]->height())};
  }

  /// Of whole tiles, about a megabyte of texels each; those of a level that is compared with the one after it are as
  /// large as what makes a window there.
  std::vector<Window> windows(std::size_t level) const {
    const Window block = levels_[level]->block();
    const auto whole = [](std::int32_t tile, std::int32_t size) {
      return tile >= size ? size : std::max(1, 1024 / tile) * tile;
    };
    const LevelSize all = size(level);
    const std::int32_t width = whole(block.width, all.width), height = whole(block.height, all.height);
    std::vector<Window> found;
    for (std::int32_t y = 0; y < all.height; y += height)
      for (std::int32_t x = 0; x < all.width; x += width) {
        found.push_back(clipped({x, y, width, height}, all));
        if (x > all.width - width) break;  // x must not overflow
      }
    return found;
  }

  bool comparable(std::size_t level) const {
    if (!map_.reduction || level == 0) return false;
    const LevelSize fine = size(level - 1), coarse = size(level);
    return coarse.width == fine.width - fine.width / 2 && coarse.height == fine.height - fine.height / 2;
  }

  /// What is stored of a window's tiles, as far as that can be asked.
  struct Stored {
    bool any = false;
    std::int64_t lost = 0;  // tiles that do not lie in the file, which their structure's check has told
  };
  Stored stored_tiles(std::size_t level, const Window& window) const {
    if (!map_.tiff) return {true, 0};
    const tiff::Directory& image = map_.tiff->directories()[map_.directories[level]];
    const auto width = static_cast<std::int32_t>(image.format.tile_width),
               height = static_cast<std::int32_t>(image.format.tile_height);
    std::vector<tiff::TileAddress> tiles;
    for (std::uint32_t plane = 0; plane < (image.format.separate ? image.format.samples : 1); ++plane)
      for (std::int32_t row = window.y / height; row <= (window.y + window.height - 1) / height; ++row)
        for (std::int32_t col = window.x / width; col <= (window.x + window.width - 1) / width; ++col)
          tiles.push_back(
              {map_.directories[level], plane, static_cast<std::uint32_t>(col), static_cast<std::uint32_t>(row)});
    Stored stored;
    for (const auto& place : map_.tiff->locate(tiles)) {
      stored.lost += place ? 0 : 1;
      stored.any |= place && place->size > 0;
    }
    return stored;
  }

  void check_window(std::size_t level, const Window& window, Difference& found, std::int64_t& damaged) const {
    const std::optional<Reducer> reducer =
        comparable(level) ? std::optional<Reducer>(std::in_place, type_, *map_.reduction, size(level - 1), size(level))
                          : std::nullopt;
    const Stored tiles = stored_tiles(level, window);
    damaged = tiles.lost;
    if (!tiles.any && !(reducer && stored_tiles(level - 1, reducer->needed(window)).any)) return;
    Block stored(type_, window);
    if (!levels_[level]->read(stored)) {
      damaged += tell_damage(level, window);
      return;
    }
    if (!reducer) return;
    Block fine(type_, reducer->needed(window));
    if (!levels_[level - 1]->read(fine)) return;  // told where that level was looked at
    Block made(type_, window);
    reducer->reduce(fine, made);
    found = tiff::with_sample(type_.sample,
                              [&]<class T>(T) { return Comparison<T>(type_, bound_, stored, made).of(window); });
    if (found.texels > 0)
      faults_.add(
          static_cast<int>(level), window.y, window.x,
          fmt::format("level {}: {} texels of columns {} to {}, rows {} to {}, differ from what level {} gives, "
                      "by {:.6g} at most: build it again",
                      level, found.texels, window.x, window.x + window.width, window.y, window.y + window.height,
                      level - 1, found.greatest));
  }

  /// Which tiles of a window lie in the file and cannot be decoded. How many.
  std::int64_t tell_damage(std::size_t level, const Window& window) const {
    const Window block = levels_[level]->block();
    std::int64_t count = 0;
    for (std::int32_t y = window.y; y < window.y + window.height; y += block.height)
      for (std::int32_t x = window.x; x < window.x + window.width; x += block.width) {
        const Window place = clipped({x, y, block.width, block.height}, size(level));
        if (!stored_tiles(level, place).any) continue;
        Block tile(type_, place);
        const auto read = levels_[level]->read(tile);
        if (read) continue;
        ++count;
        faults_.add(
            static_cast<int>(level), y / block.height, x / block.width,
            fmt::format("level {}, tile ({}, {}): {}", level, x / block.width, y / block.height, read.error().message));
      }
    return count;
  }

  void judge(int level, const Difference& sum) {
    LevelCheck& check = report_.levels[static_cast<std::size_t>(level)];
    check.compared = comparable(static_cast<std::size_t>(level));
    if (!check.compared) return;
    check.rms = sum.samples == 0 ? 0 : std::sqrt(sum.squares / static_cast<double>(sum.samples));
    check.greatest = sum.greatest;
    check.different = sum.texels;
    if (bound_.kind == LevelBound::Kind::RmsOfBrightness && check.rms > bound_.value)
      faults_.add(level, 0, 0,
                  fmt::format("level {}: differs from what level {} gives by RMS {:.4g}, more than JPEG can be off, "
                              "{:.4g}: build it again",
                              level, level - 1, check.rms, bound_.value));
  }

  const LevelsToCheck& map_;
  const std::vector<std::shared_ptr<const Source>>& levels_;
  const TexelType& type_;
  const LevelBound& bound_;
  CheckReport& report_;
  FaultList& faults_;
};

/// Mean of squares of half the steps of table 0 of JPEG's tables; nothing where they hold none.
std::optional<double> mean_square_of_half_steps(const std::vector<std::byte>& tables) {
  constexpr std::uint8_t quantization = 0xDB;
  const auto byte = [&](std::size_t i) { return std::to_integer<std::size_t>(tables[i]); };
  for (std::size_t at = 2; at + 4 <= tables.size();) {
    const std::size_t marker = byte(at + 1), length = 256 * byte(at + 2) + byte(at + 3), wide = byte(at + 4) >> 4;
    const std::size_t values = at + 5, step_bytes = wide ? 2 : 1;
    if (byte(at) != 0xFF) return std::nullopt;
    if (marker == quantization && (byte(at + 4) & 15) == 0 && values + 64 * step_bytes <= tables.size()) {
      double sum = 0;
      for (std::size_t i = 0; i < 64; ++i) {
        const std::size_t first = values + i * step_bytes;
        const double step = static_cast<double>(wide ? 256 * byte(first) + byte(first + 1) : byte(first));
        sum += step * step / 4;
      }
      return sum / 64;
    }
    at += 2 + length;
  }
  return std::nullopt;
}

/// Sum of a filter's absolute weights over both axes: by how much it may enlarge the greatest error.
double greatest_gain(Filter filter) {
  constexpr std::int32_t fine = 64, coarse = 32;  // far from edges
  const std::vector<Taps> middle = taps(filter, fine, coarse, coarse / 2, coarse / 2 + 1);
  double sum = 0;
  for (const double weight : middle.front().weights) sum += std::abs(weight);
  return sum * sum;
}

}  // namespace

LevelBound level_bound(const tiff::TileFormat& format, double max_error, const mosaic::TexelType& type,
                       const Reduction& reduction) {
  using Kind = LevelBound::Kind;
  switch (format.codec) {
    case tiff::Codec::WebP:
      return {Kind::Untold, 0};
    case tiff::Codec::Lerc:
      return max_error > 0 ? LevelBound{Kind::Greatest, (1 + greatest_gain(reduction.filter)) * max_error}
                           : LevelBound{};
    case tiff::Codec::Jpeg: {
      const auto mean_square = mean_square_of_half_steps(format.jpeg_tables);
      if (!mean_square || type.bands == 2 || type.bands > 3) return {Kind::Untold, 0};
      const double gain = reduction.filter == Filter::Lanczos ? 1.3 : 1;
      return {Kind::RmsOfBrightness, (1 + gain) * std::sqrt(*mean_square) + 1.5};
    }
    default:
      return {};
  }
}

std::string describe(const LevelBound& bound) {
  switch (bound.kind) {
    case LevelBound::Kind::Same:
      return "not at all";
    case LevelBound::Kind::Greatest:
      return fmt::format("by {:.6g} at most, and a step of integers", bound.value);
    case LevelBound::Kind::RmsOfBrightness:
      return fmt::format("in brightness by RMS {:.4g} at most, by JPEG's quantization", bound.value);
    case LevelBound::Kind::Untold:
      break;
  }
  return "by what the codec loses, which it does not tell";
}

void check_levels(const LevelsToCheck& levels, const CheckOptions& options, CheckReport& report, FaultList& faults) {
  LevelChecks(levels, report, faults).run(options);
}

}  // namespace nadir::pyramid
