#include "sample_types.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace nadir::mosaic {
namespace {

constexpr std::array<std::string_view, 10> names = {"Byte",  "Int8",   "UInt16", "Int16",   "UInt32",
                                                    "Int32", "UInt64", "Int64",  "Float32", "Float64"};

bool is_signed(Sample s) { return s == Sample::I8 || s == Sample::I16 || s == Sample::I32 || s == Sample::I64; }

/// The integer type of so many bytes.
Sample integer(bool with_sign, std::size_t bytes) {
  switch (bytes) {
    case 1:
      return with_sign ? Sample::I8 : Sample::U8;
    case 2:
      return with_sign ? Sample::I16 : Sample::U16;
    case 4:
      return with_sign ? Sample::I32 : Sample::U32;
    default:
      return with_sign ? Sample::I64 : Sample::U64;
  }
}

}  // namespace

std::optional<Sample> sample_of(std::string_view stored_type) {
  if (stored_type == "CInt16" || stored_type == "CFloat32") return Sample::F32;
  if (stored_type == "CInt32" || stored_type == "CFloat64") return Sample::F64;
  const auto it = std::find(names.begin(), names.end(), stored_type);
  if (it == names.end()) return std::nullopt;
  return static_cast<Sample>(it - names.begin());
}

bool is_complex(std::string_view stored_type) {
  return stored_type.starts_with("CInt") || stored_type.starts_with("CFloat");
}

bool is_float(Sample sample) { return sample == Sample::F32 || sample == Sample::F64; }

std::string_view to_string(Sample sample) { return names[static_cast<std::size_t>(sample)]; }

Sample common_type(Sample a, Sample b) {
  if (a == b) return a;
  const std::size_t a_bytes = tiff::size_bytes(a), b_bytes = tiff::size_bytes(b);
  if (is_float(a) || is_float(b)) {
    // 24 bits of mantissa hold all integers of 16 bits.
    const auto fits_f32 = [](Sample s, std::size_t bytes) { return s == Sample::F32 || bytes <= 2; };
    return fits_f32(a, a_bytes) && fits_f32(b, b_bytes) ? Sample::F32 : Sample::F64;
  }
  if (is_signed(a) == is_signed(b)) return a_bytes > b_bytes ? a : b;
  const std::size_t with_sign = is_signed(a) ? a_bytes : b_bytes, without = is_signed(a) ? b_bytes : a_bytes;
  const std::size_t bytes = std::max(with_sign, 2 * without);
  if (bytes > 8 || (bytes == 8 && with_sign < 8)) return Sample::F64;
  return integer(true, bytes);
}

std::optional<double> nodata_held(Sample sample, double nodata) {
  return tiff::with_sample(sample, [&]<class T>(T) -> std::optional<double> {
    if constexpr (std::is_floating_point_v<T>) {
      constexpr double largest = std::numeric_limits<T>::max();
      if (!std::isfinite(nodata)) return nodata;
      return static_cast<double>(static_cast<T>(std::clamp(nodata, -largest, largest)));
    } else {
      // As double the largest of 64 bits is the first beyond them.
      constexpr double beyond = 2.0 * (static_cast<double>(std::numeric_limits<T>::max() / 2 + 1));
      if (!(nodata == std::floor(nodata)) || nodata < static_cast<double>(std::numeric_limits<T>::min()) ||
          nodata >= beyond)
        return std::nullopt;
      return nodata;
    }
  });
}

bool same_nodata(const std::optional<double>& a, const std::optional<double>& b) {
  return a == b || (a && b && std::isnan(*a) && std::isnan(*b));
}

double opaque(Sample sample) {
  return tiff::with_sample(sample, []<class T>(T) {
    return std::is_floating_point_v<T> ? 1.0 : static_cast<double>(std::numeric_limits<T>::max());
  });
}

}  // namespace nadir::mosaic
