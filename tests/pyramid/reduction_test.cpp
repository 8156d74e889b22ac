#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>

#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <tuple>

#include "pyramid/blocks.h"
#include "reduction.h"

namespace nadir::pyramid {
namespace {

constexpr std::array all_filters = {Filter::Box, Filter::Gaussian, Filter::Lanczos, Filter::Nearest, Filter::Mode};
constexpr std::array<LevelSize, 7> all_sizes = {{{24, 16}, {23, 17}, {24, 11}, {13, 8}, {1, 9}, {2, 1}, {1, 1}}};

std::string name_of(Filter filter, const TexelType& type, LevelSize size) {
  return std::string(to_string(filter)) + " sample " + std::to_string(static_cast<int>(type.sample)) + " bands " +
         std::to_string(type.bands) + (type.alpha ? " alpha" : "") + (type.mask ? " mask" : "") +
         (type.nodata ? " nodata" : "") + " of " + std::to_string(size.width) + "x" + std::to_string(size.height);
}

Block reduced(const TexelType& type, const Reduction& reduction, LevelSize size, const Block& fine,
              std::optional<Window> window = std::nullopt) {
  const LevelSize coarse = half(size);
  Block out(type, window.value_or(all_of(coarse)));
  Reducer(type, reduction, size, coarse).reduce(fine, out);
  return out;
}

void expect_same_bytes(const Block& whole, const Block& part, const std::string& what) {
  const Window& w = part.window();
  for (std::int32_t y = w.y; y < w.y + w.height; ++y) {
    const auto skip = static_cast<std::size_t>(w.x - whole.window().x);
    ASSERT_EQ(std::memcmp(whole.row(y) + skip * whole.texel_bytes(), part.row(y), part.row_bytes()), 0)
        << what << " row " << y;
    if (whole.masked()) {
      ASSERT_EQ(std::memcmp(whole.valid_row(y) + skip, part.valid_row(y), static_cast<std::size_t>(w.width)), 0)
          << what << " validity of row " << y;
    }
  }
}

// --- The definition, written anew, in long double: weights by intersection, one texel at a time.

struct WeightedTexel {
  std::int32_t x, y;
  long double weight;
};

/// Weights along one axis; `box`: by covered length, whatever the filter.
std::map<std::int32_t, long double> make_oracle_axis(Filter filter, std::int32_t fine, std::int32_t coarse,
                                                     std::int32_t i) {
  const long double step = static_cast<long double>(fine) / coarse, centre = (i + 0.5L) * step;
  std::map<std::int32_t, long double> weights;
  for (std::int32_t j = 0; j < fine; ++j) {
    long double weight = 0;
    const long double d = (j + 0.5L - centre) / step;
    if (filter == Filter::Box || filter == Filter::Mode)  // whole numbers, in units of 1 / coarse
      weight = std::max(0, std::min((j + 1) * coarse, (i + 1) * fine) - std::max(j * coarse, i * fine));
    else if (filter == Filter::Gaussian)
      weight = std::abs(d) <= 1.5L ? std::exp(-2 * d * d) : 0;
    else if (filter == Filter::Lanczos) {
      const long double p = std::numbers::pi_v<long double> * d;
      weight = std::abs(d) >= 3 ? 0 : d == 0 ? 1 : 3 * std::sin(p) * std::sin(p / 3) / (p * p);
    } else {
      weight = j < centre && centre <= j + 1 ? 1 : 0;  // two touch: the lower
    }
    if (std::abs(weight) > 1e-15L) weights[j] = weight;
  }
  long double sum = 0;
  for (const auto& [j, weight] : weights) sum += weight;
  for (auto& [j, weight] : weights) weight /= sum;
  return weights;
}

/// The same, made once.
const std::map<std::int32_t, long double>& oracle_axis(Filter filter, std::int32_t fine, std::int32_t coarse,
                                                       std::int32_t i) {
  static std::map<std::tuple<Filter, std::int32_t, std::int32_t>, std::map<std::int32_t, long double>> made;
  const auto [it, first] = made.try_emplace({filter, fine, i});
  if (first) it->second = make_oracle_axis(filter, fine, coarse, i);
  return it->second;
}

template <class T>
struct Oracle {
  const TexelType& type;
  Filter filter;
  LevelSize fine, coarse;
  const Block& block;

  std::vector<WeightedTexel> texels(Filter by, std::int32_t i, std::int32_t j) const {
    std::vector<WeightedTexel> all;
    for (const auto& [y, v] : oracle_axis(by, fine.height, coarse.height, j))
      for (const auto& [x, u] : oracle_axis(by, fine.width, coarse.width, i)) all.push_back({x, y, u * v});
    return all;
  }
  long double alpha(const WeightedTexel& t) const {
    return type.alpha ? static_cast<long double>(sample_at<T>(block, type, t.x, t.y, type.bands - 1)) : 1.0L;
  }
  bool unmasked(const WeightedTexel& t) const { return !type.mask || block.valid_row(t.y)[t.x] == 255; }
  bool counts(const WeightedTexel& t, int band) const {
    const T sample = sample_at<T>(block, type, t.x, t.y, band);
    return unmasked(t) && alpha(t) > 0 && std::isfinite(static_cast<long double>(sample)) &&
           !(type.nodata && static_cast<double>(sample) == *type.nodata);
  }

  bool is_whole(const WeightedTexel& t) const {
    bool whole = !type.alpha || sample_at<T>(block, type, t.x, t.y, type.bands - 1) == mosaic::Validity<T>::opaque();
    for (int b = 0; b < type.data_bands(); ++b) whole &= counts(t, b);
    return whole;
  }

  /// The exact value of a data band; empty where nothing is valid.
  std::optional<long double> value(std::int32_t i, std::int32_t j, int band) const {
    const auto mean = [&](Filter by) -> std::optional<long double> {
      long double sum = 0, total = 0, size = 0;
      for (const auto& t : texels(by, i, j)) {
        if (!counts(t, band)) continue;
        sum += t.weight * alpha(t) * static_cast<long double>(sample_at<T>(block, type, t.x, t.y, band));
        total += t.weight * alpha(t);
        size += std::abs(t.weight) * alpha(t);
      }
      bool whole = true;
      for (const auto& t : texels(by, i, j)) whole &= is_whole(t);
      if (total <= 0 || (!whole && total < size / 2)) return std::nullopt;
      return sum / total;
    };
    if (filter == Filter::Mode) {
      std::map<T, long double> areas;
      for (const auto& t : texels(filter, i, j))
        if (counts(t, band)) areas[sample_at<T>(block, type, t.x, t.y, band)] += t.weight;
      std::optional<long double> best;
      long double most = 0;
      for (const auto& [sample, area] : areas)
        if (area > most + 1e-12L) {
          most = area;
          best = static_cast<long double>(sample);
        }
      return best;
    }
    const auto box = mean(filter == Filter::Nearest ? filter : Filter::Box);
    if (!box || filter == Filter::Box || filter == Filter::Nearest) return box;
    const auto by_kernel = mean(filter);
    return by_kernel ? by_kernel : box;
  }
  long double opacity(std::int32_t i, std::int32_t j) const {
    long double sum = 0, total = 0;
    for (const auto& t : texels(filter == Filter::Nearest ? filter : Filter::Box, i, j)) {
      if (!unmasked(t)) continue;
      sum += t.weight * alpha(t);
      total += t.weight;
    }
    return total > 0 ? sum / total : 0;
  }
};

/// Farthest that a result may be from the exact value: half a step of an integer, and a whole one beside nodata; and
/// what is lost on the way. Box: some sixteen operations of half a last bit each, here or in the oracle. Kernels: their
/// weights are doubles, made by squaring eight times, which doubles an error each time.
template <class T>
long double tolerance(const TexelType& type, long double exact, Filter filter) {
  if (filter == Filter::Mode) return 0;
  const bool wide = std::is_integral_v<T> && sizeof(T) == 8,
             kernel = filter == Filter::Gaussian || filter == Filter::Lanczos;
  const long double magnitude =
      std::is_floating_point_v<T> ? 8192.0L : static_cast<long double>(std::numeric_limits<T>::max());
  const long double bits = magnitude * (kernel ? 0x1p-44L : wide ? 0x1p-59L : 0x1p-49L);
  if (std::is_floating_point_v<T>)
    return bits + std::abs(exact) * static_cast<long double>(std::numeric_limits<T>::epsilon()) / 2;
  const bool near_nodata = type.nodata && std::abs(exact - static_cast<long double>(*type.nodata)) <= 0.5L + bits;
  return (near_nodata ? 1.0L : 0.5L) + bits;
}

template <class T>
void expect_like_oracle(const TexelType& type, Filter filter, LevelSize size, const Block& fine) {
  const LevelSize coarse = half(size);
  const Block result = reduced(type, {filter, false, {}, {}}, size, fine);
  const Oracle<T> oracle{type, filter, size, coarse, fine};
  const std::string what = name_of(filter, type, size);
  for (std::int32_t j = 0; j < coarse.height; ++j)
    for (std::int32_t i = 0; i < coarse.width; ++i) {
      SCOPED_TRACE(what + " at " + std::to_string(i) + "," + std::to_string(j));
      std::vector<std::optional<long double>> exact;
      bool any = false;
      for (int b = 0; b < type.data_bands(); ++b) {
        exact.push_back(oracle.value(i, j, b));
        any |= exact.back().has_value();
      }
      if (type.alpha) {
        const long double opacity = any ? oracle.opacity(i, j) : 0;
        const T alpha = sample_at<T>(result, type, i, j, type.bands - 1);
        ASSERT_LE(std::abs(static_cast<long double>(alpha) - opacity),
                  tolerance<T>(TexelType{type.sample}, opacity, filter == Filter::Mode ? Filter::Box : filter));
        any &= alpha != T{};
      }
      if (type.mask) {
        ASSERT_EQ(result.valid_row(j)[i], any ? 255 : 0);
      }
      for (int b = 0; b < type.data_bands(); ++b) {
        const T sample = sample_at<T>(result, type, i, j, b);
        if (any && exact[static_cast<std::size_t>(b)]) {
          const long double lowest = std::numeric_limits<T>::lowest(), highest = std::numeric_limits<T>::max();
          const long double value = std::clamp(*exact[static_cast<std::size_t>(b)], lowest, highest);
          ASSERT_LE(std::abs(static_cast<long double>(sample) - value), tolerance<T>(type, value, filter))
              << "band " << b << ": " << +sample << " for " << value;
          if (type.nodata) {
            ASSERT_NE(static_cast<double>(sample), *type.nodata);
          }
        } else if (type.nodata) {
          ASSERT_EQ(static_cast<double>(sample), *type.nodata);
        } else if (std::is_floating_point_v<T> && (any || (!type.mask && !type.alpha))) {
          ASSERT_NE(sample, sample);  // a hole beside data, or the only way to tell one
        } else {
          ASSERT_EQ(sample, T{});
        }
      }
    }
}

class EveryFilter : public testing::TestWithParam<Filter> {};
INSTANTIATE_TEST_SUITE_P(Reduction, EveryFilter, testing::ValuesIn(all_filters),
                         [](const auto& p) { return std::string(to_string(p.param)); });

TEST_P(EveryFilter, IsWhatItsDefinitionSays) {
  unsigned seed = 0;
  for (const Sample sample : all_samples)
    for (const Holes holes : all_holes)
      for (const LevelSize size : all_sizes)
        for (const unsigned missing : {0u, 1u, 5u}) {
          const bool alpha = holes == Holes::Alpha || holes == Holes::AlphaAndMask;
          const TexelType type = texel_type(sample, static_cast<int>(seed % 3) + (alpha ? 2 : 1), holes);
          const unsigned values = GetParam() == Filter::Mode ? 5 : 0;
          const Block fine = random_block(type, all_of(size), ++seed, missing, values);
          tiff::with_sample(sample, [&]<class T>(T) { expect_like_oracle<T>(type, GetParam(), size, fine); });
          if (HasFatalFailure()) return;
        }
}

TEST_P(EveryFilter, GivesTheSameBytesHoweverALevelIsDivided) {
  // Sizes beyond what kernels take at once; windows of a texel, of a row, and across those sizes.
  std::mt19937 random(3);
  for (const Sample sample : {Sample::U8, Sample::I16, Sample::U32, Sample::F32, Sample::F64})
    for (const Holes holes : all_holes)
      for (const LevelSize size : {LevelSize{600, 8}, LevelSize{599, 7}, LevelSize{300, 7}})
        for (const bool power : {false, true}) {
          if (power && size.width == 600) continue;
          const TexelType type = texel_type(sample, 3, holes);
          const LevelSize coarse = half(size);
          const Reduction reduction{GetParam(), power, {}, {}};
          const Reducer reducer(type, reduction, size, coarse);
          const Block fine = random_block(type, all_of(size), random(), random() % 2);
          const Block whole = reduced(type, reduction, size, fine);
          for (int k = 0; k < 6; ++k) {
            Window w;
            w.x = static_cast<std::int32_t>(random() % static_cast<unsigned>(coarse.width));
            w.y = static_cast<std::int32_t>(random() % static_cast<unsigned>(coarse.height));
            w.width = k == 0 ? 1 : 1 + static_cast<std::int32_t>(random() % static_cast<unsigned>(coarse.width - w.x));
            w.height = 1 + static_cast<std::int32_t>(random() % static_cast<unsigned>(coarse.height - w.y));
            // Only what is said to be needed is there: the rest has no memory.
            const Window needed = reducer.needed(w);
            Block part(type, needed);
            for (std::int32_t y = needed.y; y < needed.y + needed.height; ++y) {
              std::memcpy(part.row(y), fine.row(y) + static_cast<std::size_t>(needed.x) * fine.texel_bytes(),
                          part.row_bytes());
              if (type.mask)
                std::memcpy(part.valid_row(y), fine.valid_row(y) + needed.x, static_cast<std::size_t>(needed.width));
            }
            expect_same_bytes(whole, reduced(type, reduction, size, part, w), name_of(GetParam(), type, size));
            if (HasFatalFailure()) return;
          }
        }
}

TEST_P(EveryFilter, NeedsExactlyTheTexelsThatHaveWeight) {
  for (const std::int32_t fine : {1, 2, 3, 7, 8, 23, 24}) {
    const std::int32_t coarse = fine - fine / 2;
    const Reducer reducer(TexelType{}, {GetParam(), false, {}, {}}, {fine, 1}, {coarse, 1});
    for (std::int32_t i = 0; i < coarse; ++i)
      for (std::int32_t end = i + 1; end <= coarse; ++end) {
        const Window needed = reducer.needed({i, 0, end - i, 1});
        EXPECT_EQ(needed.x, oracle_axis(GetParam(), fine, coarse, i).begin()->first);
        EXPECT_EQ(needed.x + needed.width, oracle_axis(GetParam(), fine, coarse, end - 1).rbegin()->first + 1);
        EXPECT_EQ(needed.height, 1);
      }
  }
}

TEST_P(EveryFilter, LeavesWhatIsConstantAsItIs) {
  for (const Sample sample : all_samples)
    for (const bool greatest : {false, true})
      for (const bool power : {false, true})
        for (const LevelSize size : {LevelSize{20, 12}, LevelSize{21, 13}})
          tiff::with_sample(sample, [&]<class T>(T) {
            const TexelType type{sample, 2};
            const T value = greatest ? std::numeric_limits<T>::max() : static_cast<T>(-37);
            Block fine(type, all_of(size));
            for (std::int32_t y = 0; y < size.height; ++y)
              std::fill_n(reinterpret_cast<T*>(fine.row(y)), 2 * size.width, value);
            const Block result = reduced(type, {GetParam(), power, {0.5, -2}, {3, 0}}, size, fine);
            for (std::int32_t y = 0; y < result.window().height; ++y)
              for (std::int32_t x = 0; x < result.window().width; ++x) {
                // Weights of kernels are doubles whose sum is 1 but for their last bits; powers are doubles.
                const T sample_there = sample_at<T>(result, type, x, y, 1);
                const long double off =
                    std::abs(static_cast<long double>(sample_there) - static_cast<long double>(value));
                const bool kernel = GetParam() == Filter::Gaussian || GetParam() == Filter::Lanczos;
                const bool exact = sizeof(T) < 8 || (!kernel && !power) || (std::is_floating_point_v<T> && power);
                ASSERT_LE(off, exact ? 0 : std::abs(static_cast<long double>(value)) * 0x1p-48L)
                    << name_of(GetParam(), type, size);
              }
          });
}

}  // namespace
}  // namespace nadir::pyramid
