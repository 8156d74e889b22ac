#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "nadir/base/result.h"

namespace nadir::tile {

/// Type of one sample as cells hold it and frames return it. Wider stored types are read as Float32.
enum class SampleType : std::uint8_t { UInt8, Int16, UInt16, Float32 };

std::size_t size_bytes(SampleType type);
std::string_view to_string(SampleType type);  // "uint8", "int16", "uint16", "float32"
Result<SampleType> parse_sample_type(std::string_view name);

/// The SampleType of a C++ type.
template <class T>
inline constexpr SampleType sample_type_of = SampleType::UInt8;
template <>
inline constexpr SampleType sample_type_of<std::int16_t> = SampleType::Int16;
template <>
inline constexpr SampleType sample_type_of<std::uint16_t> = SampleType::UInt16;
template <>
inline constexpr SampleType sample_type_of<float> = SampleType::Float32;

/// Calls `f(T{})` with the C++ type of `type`.
template <class F>
decltype(auto) with_sample_type(SampleType type, F&& f) {
  switch (type) {
    case SampleType::Int16:
      return f(std::int16_t{});
    case SampleType::UInt16:
      return f(std::uint16_t{});
    case SampleType::Float32:
      return f(float{});
    case SampleType::UInt8:
      break;
  }
  return f(std::uint8_t{});
}

}  // namespace nadir::tile
