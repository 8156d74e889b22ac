#include <array>
#include <cstring>

#include "cover_filter.h"
#include "row_kernels.h"
#include "taps.h"

namespace nadir::pyramid {
namespace {

using mosaic::Mean, mosaic::samples_at, mosaic::to_sample, mosaic::valid_at;

/// Rows by columns of finer rows, each filtered once; texels where something under the kernel does not count in full
/// one by one. Which way a texel goes depends on its own samples alone.
template <class T>
class KernelFilter {
 public:
  KernelFilter(const LevelPair& pair, const Block& fine, Block& coarse)
      : pair_(pair),
        validity_(pair.type),
        fine_(fine),
        coarse_(coarse),
        texel_(pair, fine),
        bands_(static_cast<std::size_t>(pair.type.bands)) {
    const Window& w = coarse.window();
    columns_ = taps(pair.reduction.filter, pair.x.fine, pair.x.coarse, w.x, w.x + w.width);
    rows_ = taps(pair.reduction.filter, pair.y.fine, pair.y.coarse, w.y, w.y + w.height);
    if (in_doubles) find_runs();
  }

  void run() {
    const Window& window = coarse_.window();
    whole_.assign(columns_.size(), 0);
    for (std::size_t row = 0; row < rows_.size(); ++row) {
      const std::int32_t y = window.y + static_cast<std::int32_t>(row);
      T* out = reinterpret_cast<T*>(coarse_.row(y));
      std::uint8_t* valid = coarse_.masked() ? coarse_.valid_row(y) : nullptr;
      if (!pair_.reduction.power && filter_row(rows_[row], out)) {
        if (valid) std::memset(valid, 255, columns_.size());
        continue;
      }
      for (std::size_t col = 0; col < columns_.size(); col += stretch_columns)
        complete(col, std::min(columns_.size(), col + stretch_columns), rows_[row], y, out, valid);
    }
  }

 private:
  struct FilteredRow {
    std::int32_t y = -1;
    std::vector<Mean<T>> means;  // of each coarser column and band
    bool all_whole = true, all_void = false;
    std::vector<std::uint8_t> whole;  // else each coarser column
  };
  static constexpr bool in_doubles = std::is_same_v<Mean<T>, double>;

  /// Columns of as many taps each, which begin two texels after those of the one before.
  struct Run {
    std::size_t begin = 0, end = 0;
    bool alike = true;            // whether all have the weights of the first
    std::vector<double> weights;  // else those of each sample, first taps of all first
    std::size_t columns() const { return end - begin; }
  };

  void find_runs() {
    for (std::size_t begin = 0; begin < columns_.size(); begin = runs_.back().end) {
      Run run{begin, begin + 1, true, {}};
      const Taps& first = columns_[begin];
      const auto follows = [&](const Taps& taps) {
        return taps.weights.size() == first.weights.size() &&
               taps.first == first.first + 2 * static_cast<std::int32_t>(run.columns());
      };
      for (; run.end < columns_.size() && follows(columns_[run.end]); ++run.end)
        run.alike &= columns_[run.end].weights == first.weights;
      for (std::size_t k = 0; !run.alike && k < first.weights.size(); ++k)
        for (std::size_t col = run.begin; col < run.end; ++col)
          run.weights.insert(run.weights.end(), bands_, columns_[col].weights[k]);
      runs_.push_back(std::move(run));
    }
  }

  /// A row of the finer level, filtered along its columns; kept as long as the next rows need it.
  const FilteredRow& filtered(std::int32_t y) {
    FilteredRow& row = filtered_[static_cast<std::size_t>(y) % filtered_.size()];
    if (row.y == y) return row;
    row.y = y;
    row.means.resize(columns_.size() * bands_);
    const std::int32_t left = fine_.window().x;
    const T* samples = samples_at<T>(fine_, pair_.type, left, y);
    find_whole_columns(samples, valid_at(fine_, left, y), row);
    if (row.all_void) {
      std::fill(row.means.begin(), row.means.end(), Mean<T>{});
      return row;
    }
    if constexpr (in_doubles) {
      for (const Run& run : runs_) filter_run(run, samples, row.means.data() + run.begin * bands_);
    } else {
      for (std::size_t col = 0; col < columns_.size(); ++col)
        filter_column(columns_[col], samples, row.means.data() + col * bands_);
    }
    return row;
  }

  void filter_column(const Taps& across, const T* samples, Mean<T>* means) const {
    const T* first = samples + static_cast<std::size_t>(across.first - fine_.window().x) * bands_;
    for (std::size_t b = 0; b < bands_; ++b) {
      const T* from = first + b;
      Mean<T> mean = 0;
      for (std::size_t k = 0; k < across.weights.size(); ++k, from += bands_)
        mean += static_cast<Mean<T>>(across.weights[k]) * static_cast<Mean<T>>(*from);
      means[b] = mean;
    }
  }

  void find_whole_columns(const T* samples, const std::uint8_t* valid, FilteredRow& row) {
    const auto texels = static_cast<std::size_t>(fine_.window().width);
    row.all_whole = is_whole(pair_.type, validity_, samples, valid, texels) && all_finite(samples, texels * bands_);
    row.all_void = !row.all_whole && is_void(pair_.type, validity_, samples, valid, texels);
    if (row.all_whole) return;
    row.whole.assign(columns_.size(), 0);
    if (row.all_void) return;
    holes_before_.assign(1, 0);
    for (std::size_t x = 0; x < texels; ++x)
      holes_before_.push_back(holes_before_.back() +
                              (validity_.whole(samples + x * bands_, valid ? valid + x : nullptr) ? 0 : 1));
    for (std::size_t col = 0; col < columns_.size(); ++col) {
      const auto first = static_cast<std::size_t>(columns_[col].first - fine_.window().x);
      row.whole[col] = holes_before_[first + columns_[col].weights.size()] == holes_before_[first] ? 1 : 0;
    }
  }

  /// All columns of a run at once.
  void filter_run(const Run& run, const T* samples, double* means) {
    const Taps& across = columns_[run.begin];
    const std::size_t count = across.weights.size();
    // The last one's weights may end amid a pair, whose second texel need not be there.
    const std::size_t pairs = run.columns() - 1 + count / 2, stored = (pairs + count % 2) * bands_;
    split_.resize(2 * stored);
    const T* first = samples + static_cast<std::size_t>(across.first - fine_.window().x) * bands_;
    pyramid::run<SplitPairs<T>>(first, split_.data(), split_.data() + stored, pairs, bands_);
    for (std::size_t b = 0; count % 2 == 1 && b < bands_; ++b)
      split_[pairs * bands_ + b] = static_cast<double>(first[2 * pairs * bands_ + b]);
    std::array<const double*, most_taps> at;
    for (std::size_t k = 0; k < count; ++k) at[k] = split_.data() + (k % 2) * stored + k / 2 * bands_;
    const double* const* rows = at.data();
    const std::size_t sums = run.columns() * bands_;
    if (run.alike)
      pyramid::run<WeighRows>(rows, across.weights.data(), count, means, sums);
    else
      pyramid::run<WeighColumns>(rows, run.weights.data(), count, means, sums);
  }

  /// Makes the columns that are whole, which `whole_` tells then; true where all are.
  bool filter_row(const Taps& down, T* out) {
    const std::size_t count = down.weights.size();
    std::array<const Mean<T>*, most_taps> from;
    bool all = true, any_void = false;
    for (std::size_t k = 0; k < count; ++k) {
      const FilteredRow& row = filtered(down.first + static_cast<std::int32_t>(k));
      from[k] = row.means.data();
      all &= row.all_whole;
      any_void |= row.all_void;
    }
    std::fill(whole_.begin(), whole_.end(), static_cast<std::uint8_t>(any_void ? 0 : 1));
    if (any_void) return false;
    for (std::size_t k = 0; !all && k < count; ++k) {
      const FilteredRow& row = filtered(down.first + static_cast<std::int32_t>(k));
      for (std::size_t col = 0; !row.all_whole && col < whole_.size(); ++col) whole_[col] &= row.whole[col];
    }
    weigh_rows(from.data(), down);
    if constexpr (std::is_integral_v<T> && sizeof(T) <= 2) {
      if (!validity_.has_nodata()) {  // what is not whole is made again
        pyramid::run<RoundMeans<T>>(static_cast<const double*>(sums_.data()), out, sums_.size());
        return all;
      }
    }
    for (std::size_t col = 0; col < whole_.size(); ++col)
      for (std::size_t i = col * bands_; whole_[col] && i < (col + 1) * bands_; ++i) {
        if (is_number(sums_[i]))
          out[i] = to_sample<T>(sums_[i], validity_);
        else
          whole_[col] = 0, all = false;  // doubles that overflow
      }
    return all;
  }

  void weigh_rows(const Mean<T>* const* from, const Taps& down) {
    sums_.resize(columns_.size() * bands_);
    if constexpr (in_doubles) {
      pyramid::run<WeighRows>(from, down.weights.data(), down.weights.size(), sums_.data(), sums_.size());
    } else {
      std::fill(sums_.begin(), sums_.end(), Mean<T>{});
      for (std::size_t k = 0; k < down.weights.size(); ++k)
        for (std::size_t i = 0; i < sums_.size(); ++i) sums_[i] += static_cast<Mean<T>>(down.weights[k]) * from[k][i];
    }
  }

  static constexpr std::size_t stretch_columns = 128;

  /// Texels of columns from `begin` to `end` that are not whole.
  void complete(std::size_t begin, std::size_t end, const Taps& down, std::int32_t y, T* out, std::uint8_t* valid) {
    const std::int32_t first = coarse_.window().x + static_cast<std::int32_t>(begin);
    const bool any_whole = std::find(whole_.begin() + static_cast<std::ptrdiff_t>(begin),
                                     whole_.begin() + static_cast<std::ptrdiff_t>(end),
                                     1) != whole_.begin() + static_cast<std::ptrdiff_t>(end);
    if (!any_whole &&
        CoveredRows<T>(pair_, fine_, first, y, static_cast<std::int32_t>(end - begin)).all_void(pair_.type, validity_))
      return texel_.fill_with_nothing(out + begin * bands_, valid ? valid + begin : nullptr, end - begin);
    for (std::size_t col = begin; col < end; ++col) {
      bool held = true;
      if (!whole_[col])
        held = reduce_texel(coarse_.window().x + static_cast<std::int32_t>(col), y, columns_[col], down,
                            out + col * bands_);
      if (valid) valid[col] = held ? 255 : 0;
    }
  }

  static bool is_number(Mean<T> value) { return value - value == 0; }

  /// One texel from what counts: the box says whether it holds data, and stands in where negative weights have more
  /// than a third of the positive ones.
  bool reduce_texel(std::int32_t x, std::int32_t y, const Taps& across, const Taps& down, T* out) {
    const bool held = texel_.reduce(x, y, out);
    if (!held) return false;
    for (std::size_t b = 0; b < static_cast<std::size_t>(pair_.type.data_bands()); ++b)
      if (texel_.held(b)) pair_.reduction.power ? weigh_power(b, across, down, out[b]) : weigh(b, across, down, out[b]);
    return true;
  }

  /// Calls `take(sample, weight)` for all samples of a band that count.
  template <class Take>
  void for_each(std::size_t b, const Taps& across, const Taps& down, Take&& take) const {
    const auto data_bands = static_cast<std::size_t>(pair_.type.data_bands());
    for (std::size_t j = 0; j < down.weights.size(); ++j) {
      const std::int32_t y = down.first + static_cast<std::int32_t>(j);
      const T* texel = samples_at<T>(fine_, pair_.type, across.first, y);
      const std::uint8_t* valid = valid_at(fine_, across.first, y);
      for (std::size_t i = 0; i < across.weights.size(); ++i, texel += bands_) {
        if (!validity_.texel(texel, valid ? valid + i : nullptr) || !validity_.sample(texel[b])) continue;
        long double weight = static_cast<long double>(down.weights[j]) * static_cast<long double>(across.weights[i]);
        if (pair_.type.alpha)
          weight *=
              static_cast<long double>(texel[data_bands]) / static_cast<long double>(mosaic::Validity<T>::opaque());
        if (std::abs(weight) <= std::numeric_limits<long double>::max()) take(texel[b], weight);
      }
    }
  }

  void weigh(std::size_t b, const Taps& across, const Taps& down, T& out) const {
    long double sum = 0, total = 0, size = 0;
    for_each(b, across, down, [&](T sample, long double weight) {
      sum += weight * static_cast<long double>(sample);
      total += weight;
      size += std::abs(weight);
    });
    if (total >= size / 2) out = to_sample<T>(static_cast<Mean<T>>(sum / total), validity_);
  }

  void weigh_power(std::size_t b, const Taps& across, const Taps& down, T& out) const {
    MeanOfPower power(pair_.reduction, b);
    long double total = 0, size = 0;
    for_each(b, across, down, [&](T sample, long double weight) {
      power.look_at(static_cast<double>(sample));
      total += weight;
      size += std::abs(weight);
    });
    if (total < size / 2) return;
    for_each(b, across, down, [&](T sample, long double weight) {
      power.add(static_cast<double>(sample), static_cast<double>(weight));
    });
    if (power.valid()) out = to_sample<T>(static_cast<Mean<T>>(power.mean()), validity_);
  }

  const LevelPair& pair_;
  const mosaic::Validity<T> validity_;
  const Block& fine_;
  Block& coarse_;
  CoveredTexel<T> texel_;
  const std::size_t bands_;
  std::vector<Taps> columns_, rows_;
  std::vector<Run> runs_;                       // all columns, where they are added in doubles
  static constexpr std::size_t most_taps = 16;  // more than any filter reaches over
  std::array<FilteredRow, most_taps> filtered_;
  std::vector<double> split_;
  std::vector<Mean<T>> sums_;
  std::vector<std::uint8_t> whole_;
  std::vector<std::uint32_t> holes_before_;  // each texel of a finer row
};

}  // namespace

void reduce_by_kernel(const LevelPair& pair, const Block& fine, Block& coarse) {
  tiff::with_sample(pair.type.sample, [&]<class T>(T) { KernelFilter<T>(pair, fine, coarse).run(); });
}

}  // namespace nadir::pyramid
