#pragma once

#include <cstddef>
#include <cstdint>

namespace nadir::tiff {

/// How a sample is held in memory: the stored type in native byte order, odd widths in the next wider one.
enum class Sample : std::uint8_t { U8, I8, U16, I16, U32, I32, U64, I64, F32, F64 };
std::size_t size_bytes(Sample sample);

/// Calls `f(T{})` with the C++ type of `sample`.
template <class F>
decltype(auto) with_sample(Sample sample, F&& f) {
  switch (sample) {
    case Sample::I8:
      return f(std::int8_t{});
    case Sample::U16:
      return f(std::uint16_t{});
    case Sample::I16:
      return f(std::int16_t{});
    case Sample::U32:
      return f(std::uint32_t{});
    case Sample::I32:
      return f(std::int32_t{});
    case Sample::U64:
      return f(std::uint64_t{});
    case Sample::I64:
      return f(std::int64_t{});
    case Sample::F32:
      return f(float{});
    case Sample::F64:
      return f(double{});
    case Sample::U8:
      break;
  }
  return f(std::uint8_t{});
}

}  // namespace nadir::tiff
