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
std::size_t count_valid(std::size_t first, std::size_t end, T value, void* layer_samples, const FrameLayer& layer) {
  T* samples = static_cast<T*>(layer_samples);
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
  const std::size_t pixels = out.validity.size(), bands = static_cast<std::size_t>(out.bands);
  const auto& output = layer.options.output;
  const tile::SampleType type = output ? output->type : out.type;
  FrameBuffer<std::byte> converted(out.samples.get_allocator());
  if (output) converted.resize(pixels * bands * tile::size_bytes(type));

  /// Of pixels from `first` to `end`
  const auto to_output = [&](std::size_t first, std::size_t end) {
    tile::with_sample_type(out.type, [&]<class T>(T) {
      count_valid(first, end, T{}, out.samples.data(), out);  // what they hold may not be a number
    });
    convert(out.samples.data() + first * bands * tile::size_bytes(out.type), out.type, (end - first) * bands, *output,
            converted.data() + first * bands * tile::size_bytes(type));
  };
  const std::size_t valid = tile::with_sample_type(type, [&]<class T>(T) {
    constexpr std::size_t grain = 1 << 16;
    return tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, pixels, grain), std::size_t{0},
        [&](const tbb::blocked_range<std::size_t>& range, std::size_t count) {
          if (output) to_output(range.begin(), range.end());
          void* const samples = output ? converted.data() : out.samples.data();
          return count + count_valid(range.begin(), range.end(), invalid_value<T>(options), samples, out);
        },
        std::plus<>());
  });
  if (output) out.samples = std::move(converted);
  out.type = type;
  return static_cast<std::int64_t>(valid);
}

}  // namespace nadir::render
