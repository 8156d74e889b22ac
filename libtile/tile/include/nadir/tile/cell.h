#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "nadir/tile/sample_type.h"

namespace nadir::tile {

/// Texels a side of a cell, without its apron. Measured in renderers: rows of 64 to 128 texels sample at 2.9 ns a
/// pixel, 512 at 5, since a row of neighbours then lies in as many pages.
inline constexpr int cell_size = 128;
inline constexpr int cell_size_log2 = 7;
static_assert(cell_size == 1 << cell_size_log2);

/// Neighbouring texels on each side, so that bilinear sampling never looks into a second cell.
inline constexpr int cell_apron = 1;
inline constexpr int cell_stride = cell_size + 2 * cell_apron;

/// The block of one level that the cache holds: cell (col, row) covers texels [128 col, 128 col + 128) by
/// [128 row, 128 row + 128), with an apron. Beyond the level's edge the edge's texels are repeated.
struct Cell {
  SampleType type = SampleType::UInt8;
  int bands = 0;
  bool all_valid = true;
  std::vector<std::byte> samples;      // cell_stride * cell_stride * bands, bands interleaved, in the source's domain
  std::vector<std::uint8_t> validity;  // cell_stride * cell_stride, 1 valid, 0 not; empty where all_valid

  template <class T>
  const T* data() const {
    return reinterpret_cast<const T*>(samples.data());
  }
};
using CellPtr = std::shared_ptr<const Cell>;

/// Address of a cell in one source.
struct CellKey {
  std::uint64_t source = 0;  // CellSource::id()
  std::int32_t level = 0, col = 0, row = 0;
  friend auto operator<=>(const CellKey&, const CellKey&) = default;
};

}  // namespace nadir::tile
