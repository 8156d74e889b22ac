#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace nadir::pyramid {

/// Column by column over rows of bytes: whole numbers, the same from every kernel.
/// 32 bits hold the squares of 66 thousand rows.
struct ByteColumns {
  std::uint32_t *sums, *squares;
  std::uint8_t *least, *most;
};

/// Adds four rows of `count` bytes.
void add_four_rows(const std::array<const std::uint8_t*, 4>& rows, std::size_t count, const ByteColumns& columns);

/// Adds the squares of a - p of two rows of `count` bytes.
void add_squared_differences(const std::array<const std::uint8_t*, 2>& a, const std::array<const std::uint8_t*, 2>& p,
                             std::size_t count, std::uint32_t* squares);

namespace scalar {
void add_row(const std::uint8_t* row, std::size_t begin, std::size_t end, const ByteColumns& columns);
void add_squared_differences(const std::uint8_t* a, const std::uint8_t* p, std::size_t begin, std::size_t end,
                             std::uint32_t* squares);
}  // namespace scalar

}  // namespace nadir::pyramid
