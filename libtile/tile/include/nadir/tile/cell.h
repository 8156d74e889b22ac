#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "nadir/tile/sample_type.h"

namespace nadir::tile {

/// Texels a side of a cell. Measured in renderers: rows of 64 to 128 texels sample at 2.9 ns a pixel, 512 at 5, since a
/// row of neighbours then lies in as many pages.
inline constexpr int cell_size = 128;
inline constexpr int cell_size_log2 = 7;
static_assert(cell_size == 1 << cell_size_log2);
inline constexpr std::size_t cell_area = static_cast<std::size_t>(cell_size) * cell_size;

/// The block of one level that the cache holds: cell (col, row) covers texels [128 col, 128 col + 128) by
/// [128 row, 128 row + 128). What of it lies beyond the level's edge holds nothing of meaning.
class Cell {
 public:
  Cell(SampleType type, int bands);
  ~Cell();
  Cell(const Cell&) = delete;
  Cell& operator=(const Cell&) = delete;

  SampleType type() const { return type_; }
  int bands() const { return bands_; }

  /// Rows of cell_size texels, bands interleaved, in the source's domain. T must be its type.
  template <class T>
  const T* data() const {
    return reinterpret_cast<const T*>(samples_.get());
  }
  /// Whether some texel is invalid; then `validity` is there.
  bool masked() const { return validity_ != nullptr; }
  /// One byte a texel, 1 valid, 0 not; only where masked().
  const std::uint8_t* validity() const { return validity_.get(); }

  /// Why the tile that it belongs to could not be decoded; empty for all others.
  const std::string& damage() const { return damage_; }

  // For those who load it, before anyone else sees it.
  std::byte* samples() { return samples_.get(); }
  std::uint8_t* writable_validity();  // all valid at first
  void make_invalid(std::string damage);

 private:
  const SampleType type_;
  const int bands_;
  std::unique_ptr<std::byte[]> samples_;
  std::unique_ptr<std::uint8_t[]> validity_;
  std::string damage_;
};
using CellPtr = std::shared_ptr<const Cell>;

/// Address of a cell in one source.
struct CellKey {
  std::uint64_t source = 0;  // CellSource::id()
  std::int32_t level = 0, col = 0, row = 0;
  friend auto operator<=>(const CellKey&, const CellKey&) = default;
};

}  // namespace nadir::tile
