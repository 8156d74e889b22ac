#include "nadir/render/output.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

namespace nadir::render {
using tile::SampleType;

std::optional<Output> natural_output(SampleType type) {
  if (type == SampleType::UInt8) return Output{type, 0, 255};
  if (type == SampleType::UInt16) return Output{type, 0, 65535};
  return std::nullopt;
}

void convert(const void* samples, SampleType from, std::size_t count, const Output& output, void* converted) {
  tile::with_sample_type(from, [&]<class From>(From) {
    tile::with_sample_type(output.type, [&]<class To>(To) {
      const auto* in = static_cast<const From*>(samples);
      auto* out = static_cast<To*>(converted);
      if constexpr (std::is_floating_point_v<To>) {
        std::transform(in, in + count, out, [](From v) { return static_cast<To>(v); });
      } else {
        constexpr double highest = std::numeric_limits<To>::max();
        const double scale = highest / (output.high - output.low);
        std::transform(in, in + count, out, [&](From v) {
          return static_cast<To>(
              std::clamp(std::floor((static_cast<double>(v) - output.low) * scale + 0.5), 0.0, highest));
        });
      }
    });
  });
}

}  // namespace nadir::render
