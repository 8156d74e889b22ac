#include "validity.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace nadir::tile {
namespace {

/// The value that samples of type T are compared with; empty where none can equal it.
template <class T>
std::optional<T> nodata_as(const std::optional<double>& nodata) {
  if (!nodata || std::isnan(*nodata)) return std::nullopt;
  if constexpr (std::is_floating_point_v<T>) {
    constexpr double largest = std::numeric_limits<T>::max();
    return static_cast<T>(std::clamp(*nodata, -largest, largest));  // some writers note a double just beyond the type
  } else {
    if (*nodata != std::floor(*nodata) || *nodata < std::numeric_limits<T>::min() ||
        *nodata > std::numeric_limits<T>::max())
      return std::nullopt;
    return static_cast<T>(*nodata);
  }
}

}  // namespace

NodataRule::NodataRule(const MapDescription& map, std::span<const int> bands, SampleType type)
    : type_(type), bands_(bands.size()) {
  with_sample_type(type, [&]<class T>(T) {
    for (const int number : bands) {
      const auto value = nodata_as<T>(map.bands[static_cast<std::size_t>(number) - 1].nodata);
      every_band_has_nodata_ = every_band_has_nodata_ && value;
      nodata_.push_back(value ? static_cast<double>(*value) : 0);
    }
  });
}

void NodataRule::check(const std::byte* samples, std::size_t texels, std::uint8_t* valid) const {
  if (never()) return;
  with_sample_type(type_, [&]<class T>(T) {
    std::vector<T> nodata(nodata_.begin(), nodata_.end());
    for (std::size_t i = 0; i < texels; ++i) {
      const T* texel = reinterpret_cast<const T*>(samples) + i * bands_;
      bool all_nodata = every_band_has_nodata_, finite = true;
      for (std::size_t b = 0; b < bands_; ++b) {
        all_nodata = all_nodata && texel[b] == nodata[b];
        if constexpr (std::is_floating_point_v<T>) finite = finite && std::isfinite(texel[b]);
      }
      if (all_nodata || !finite) valid[i] = 0;
    }
  });
}

}  // namespace nadir::tile
