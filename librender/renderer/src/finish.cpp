#include "frame_layers.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <limits>

namespace nadir::render {
namespace {

template <class T>
T invalid_value(const RenderOptions& options) {
  const bool fill = options.off_map == OffMap::Fill;
  if constexpr (std::is_floating_point_v<T>)
    return fill ? static_cast<T>(options.fill_value) : std::numeric_limits<T>::quiet_NaN();
  else
    return fill ? static_cast<T>(std::clamp<double>(options.fill_value, std::numeric_limits<T>::min(),
                                                    std::numeric_limits<T>::max()))
                : T{};
}

/// Of pixels from `first` to `end`; the invalid ones get `value`.
template <class T>
std::size_t count_valid(std::size_t first, std::size_t end, T value, FrameLayer& layer) {
  T* samples = reinterpret_cast<T*>(layer.samples.data());
  const auto bands = static_cast<std::size_t>(layer.bands);
  const std::uint8_t* valid = layer.validity.data();
  constexpr std::uint64_t all_ones = 0x0101010101010101;
  std::size_t count = 0;
  for (std::size_t i = first; i < end;) {
    std::uint64_t word = 0;
    if (i + sizeof word <= end) std::memcpy(&word, valid + i, sizeof word);
    if (word == all_ones) {
      count += sizeof word;
      i += sizeof word;
      continue;
    }
    for (const std::size_t stop = std::min(i + sizeof word, end); i < stop; ++i) {
      count += valid[i];
      if (!valid[i]) std::fill_n(samples + i * bands, bands, value);
    }
  }
  return count;
}

}  // namespace

std::int64_t finish_layer(const Layer& layer, const RenderOptions& options, FrameLayer& out) {
  const std::size_t pixels = out.validity.size();
  if (const auto& output = layer.options.output) {
    out.samples = convert(out.samples.data(), out.type, pixels * static_cast<std::size_t>(out.bands), *output);
    out.type = output->type;
  }
  const std::size_t valid = tile::with_sample_type(out.type, [&]<class T>(T) {
    constexpr std::size_t grain = 1 << 16;
    return tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, pixels, grain), std::size_t{0},
        [&](const tbb::blocked_range<std::size_t>& range, std::size_t count) {
          return count + count_valid(range.begin(), range.end(), invalid_value<T>(options), out);
        },
        std::plus<>());
  });
  return static_cast<std::int64_t>(valid);
}

}  // namespace nadir::render
