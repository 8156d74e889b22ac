#include "conversion.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "sample_types.h"

namespace nadir::mosaic {
namespace {

template <class T>
bool is_nodata(T value, T nodata) {
  if constexpr (std::is_floating_point_v<T>)
    return value == nodata || (std::isnan(nodata) && std::isnan(value));
  else
    return value == nodata;
}

/// Clears what is wholly nodata in `bands`, whose values lie `pitch` apart.
template <class T>
void clear_nodata(const T* from, std::size_t pitch, const std::vector<Channel>& channels,
                  const std::vector<std::optional<double>>& nodata, std::size_t texels, std::uint8_t* valid) {
  std::vector<T> values;
  for (const auto& n : nodata) values.push_back(static_cast<T>(*n));
  for (std::size_t x = 0; x < texels; ++x) {
    bool all = true;
    for (std::size_t b = 0; b < channels.size(); ++b)
      all = all && is_nodata(from[x * pitch + static_cast<std::size_t>(channels[b].band)], values[b]);
    if (all) valid[x] = 0;
  }
}

template <class T>
constexpr T opaque_as = std::is_floating_point_v<T> ? T{1} : std::numeric_limits<T>::max();

/// `opacity` from 0 to 1 in another type.
template <class T>
T scaled_alpha(double opacity) {
  if constexpr (std::is_floating_point_v<T>) return static_cast<T>(opacity);
  if (!(opacity > 0)) return T{0};
  if (opacity >= 1) return opaque_as<T>;
  return static_cast<T>(std::floor(opacity * static_cast<double>(opaque_as<T>) + 0.5));
}

/// One component of what an index stands for; black, opaque beyond the palette.
template <class T>
std::uint8_t color_of(const Palette& palette, T index, int component) {
  if (index >= T{0} && static_cast<std::size_t>(index) < palette.size())
    return palette[static_cast<std::size_t>(index)][static_cast<std::size_t>(component)];
  return component == 3 ? 255 : 0;
}

}  // namespace

Conversion::Conversion(ConversionRule rule) : rule_(std::move(rule)) {
  const TexelType& to = rule_.to;
  const bool all_nodata = !rule_.nodata.empty() && std::all_of(rule_.nodata.begin(), rule_.nodata.end(),
                                                               [](const auto& n) { return n.has_value(); });
  nodata_clears_ = all_nodata && !to.nodata && (to.mask || to.alpha);
  alpha_clears_ = rule_.alpha && to.mask && !to.alpha;

  copies_samples_ = rule_.stored == to.sample && rule_.pitch == to.bands && to.alpha == rule_.alpha.has_value() &&
                    !(rule_.masked && to.alpha && !to.mask);
  for (int b = 0; b < static_cast<int>(rule_.data.size()); ++b)
    copies_samples_ = copies_samples_ && rule_.data[static_cast<std::size_t>(b)] == Channel{b, -1};
  if (to.alpha && rule_.alpha)
    copies_samples_ = copies_samples_ && *rule_.alpha == Channel{to.bands - 1, -1} && rule_.alpha_stored == to.sample;
  if (nodata_clears_ && to.alpha) copies_samples_ = false;
  for (const auto& nodata : rule_.nodata)
    if (nodata && to.nodata && !same_nodata(nodata, to.nodata)) copies_samples_ = false;
}

void Conversion::clear_invalid(const std::byte* from, std::size_t texels, std::uint8_t* valid) const {
  if (!nodata_clears_ && !alpha_clears_) return;
  const auto pitch = static_cast<std::size_t>(rule_.pitch);
  tiff::with_sample(rule_.stored, [&]<class T>(T) {
    const T* samples = reinterpret_cast<const T*>(from);
    if (nodata_clears_) clear_nodata(samples, pitch, rule_.data, rule_.nodata, texels, valid);
    if (!alpha_clears_) return;
    // From half on it is ground: for a type's largest value 2n + 1, from n + 1 on.
    const bool index = rule_.alpha->color >= 0;
    const Sample type = index ? Sample::U8 : rule_.alpha_stored;
    const double half = is_float(type) ? 0.5 : std::floor(opaque(type) / 2) + 1;
    const T* alpha = samples + rule_.alpha->band;
    for (std::size_t x = 0; x < texels; ++x) {
      const double value =
          index ? color_of(rule_.palette, alpha[x * pitch], rule_.alpha->color) : static_cast<double>(alpha[x * pitch]);
      if (!(value >= half)) valid[x] = 0;
    }
  });
}

void Conversion::convert_data(const std::byte* from, std::size_t texels, std::byte* to) const {
  const auto pitch = static_cast<std::size_t>(rule_.pitch), to_pitch = static_cast<std::size_t>(rule_.to.bands);
  tiff::with_sample(rule_.stored, [&]<class From>(From) {
    tiff::with_sample(rule_.to.sample, [&]<class To>(To) {
      for (std::size_t b = 0; b < rule_.data.size(); ++b) {
        const Channel& channel = rule_.data[b];
        const From* in = reinterpret_cast<const From*>(from) + channel.band;
        To* out = reinterpret_cast<To*>(to) + b;
        const auto& nodata = rule_.nodata[b];
        if (channel.color >= 0) {
          for (std::size_t x = 0; x < texels; ++x)
            out[x * to_pitch] = static_cast<To>(color_of(rule_.palette, in[x * pitch], channel.color));
        } else if (nodata && rule_.to.nodata && !same_nodata(nodata, rule_.to.nodata)) {
          const From missing = static_cast<From>(*nodata);
          const To instead = static_cast<To>(*rule_.to.nodata);
          for (std::size_t x = 0; x < texels; ++x)
            out[x * to_pitch] = is_nodata(in[x * pitch], missing) ? instead : static_cast<To>(in[x * pitch]);
        } else {
          for (std::size_t x = 0; x < texels; ++x) out[x * to_pitch] = static_cast<To>(in[x * pitch]);
        }
      }
    });
  });
}

void Conversion::convert_alpha(const std::byte* from, const std::uint8_t* valid, std::size_t texels,
                               std::byte* to) const {
  const auto pitch = static_cast<std::size_t>(rule_.pitch), to_pitch = static_cast<std::size_t>(rule_.to.bands);
  tiff::with_sample(rule_.to.sample, [&]<class To>(To) {
    To* out = reinterpret_cast<To*>(to) + to_pitch - 1;
    if (!rule_.alpha) {
      for (std::size_t x = 0; x < texels; ++x) out[x * to_pitch] = opaque_as<To>;
    } else {
      tiff::with_sample(rule_.stored, [&]<class From>(From) {
        const From* in = reinterpret_cast<const From*>(from) + rule_.alpha->band;
        const bool index = rule_.alpha->color >= 0;
        const Sample type = index ? Sample::U8 : rule_.alpha_stored;
        if (type == rule_.to.sample && !index) {
          for (std::size_t x = 0; x < texels; ++x) out[x * to_pitch] = static_cast<To>(in[x * pitch]);
          return;
        }
        for (std::size_t x = 0; x < texels; ++x) {
          const double value =
              index ? color_of(rule_.palette, in[x * pitch], rule_.alpha->color) : static_cast<double>(in[x * pitch]);
          out[x * to_pitch] = scaled_alpha<To>(value / opaque(type));
        }
      });
    }
    if (valid)
      for (std::size_t x = 0; x < texels; ++x)
        if (!valid[x]) out[x * to_pitch] = To{0};
  });
}

void Conversion::row(const std::byte* from, const std::uint8_t* mask, std::size_t texels, std::byte* to,
                     std::uint8_t* valid) const {
  static thread_local std::vector<std::uint8_t> folded;  // into alpha, where the map has no mask
  std::uint8_t* validity = rule_.to.mask ? valid : nullptr;
  if (!validity && rule_.to.alpha && (mask || nodata_clears_)) {
    folded.resize(texels);
    validity = folded.data();
  }
  if (validity) {
    if (mask)
      std::memcpy(validity, mask, texels);
    else
      std::memset(validity, 255, texels);
    clear_invalid(from, texels, validity);
  }
  if (copies_samples_) {
    std::memcpy(to, from, texels * rule_.to.texel_bytes());
    return;
  }
  convert_data(from, texels, to);
  if (rule_.to.alpha) convert_alpha(from, validity, texels, to);
}

}  // namespace nadir::mosaic
