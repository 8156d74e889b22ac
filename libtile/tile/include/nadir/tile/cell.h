#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "nadir/tile/sample_type.h"

namespace nadir::tile {

/// Texels a side of a cell, without its apron. Measured in renderers: rows of 64 to 128 texels sample at 2.9 ns a
/// pixel, 512 at 5, since a row of neighbours then lies in as many pages.
inline constexpr int cell_size = 128;
inline constexpr int cell_size_log2 = 7;
static_assert(cell_size == 1 << cell_size_log2);

/// Neighbouring texels on each side, so that bilinear sampling need not look into a second cell.
inline constexpr int cell_apron = 1;
inline constexpr int cell_stride = cell_size + 2 * cell_apron;
inline constexpr std::size_t cell_area = static_cast<std::size_t>(cell_stride) * cell_stride;

/// One of the eight parts of an apron, or with (0, 0) the cell itself: -1 before, 0 beside, 1 after the cell.
struct ApronPart {
  int dx = 0, dy = 0;
  std::uint16_t bit() const { return static_cast<std::uint16_t>(1 << (3 * (dy + 1) + dx + 1)); }
};

/// The block of one level that the cache holds: cell (col, row) covers texels [128 col, 128 col + 128) by
/// [128 row, 128 row + 128), with an apron. Beyond the level's edge the edge's texels are repeated.
///
/// Loading fills what lies in the same stored tile. Apron parts that lie in another tile are filled by `fill_apron`:
/// nothing else of a cell changes once it is loaded, and such a part is read only by those who saw that it is filled.
class Cell {
 public:
  Cell(SampleType type, int bands);
  ~Cell();
  Cell(const Cell&) = delete;
  Cell& operator=(const Cell&) = delete;

  SampleType type() const { return type_; }
  int bands() const { return bands_; }

  /// cell_area texels in rows of cell_stride, bands interleaved, in the source's domain. T must be its type.
  template <class T>
  const T* data() const {
    return reinterpret_cast<const T*>(samples_.get());
  }
  /// Whether some texel is invalid; then `validity` is there.
  bool masked() const { return masked_.load(std::memory_order_acquire); }
  /// One byte a texel, 1 valid, 0 not; only where masked().
  const std::uint8_t* validity() const { return validity_.get(); }

  /// Why the tile that it belongs to could not be decoded; empty for all others.
  const std::string& damage() const { return damage_; }

  bool has(ApronPart part) const { return parts_.load(std::memory_order_acquire) & part.bit(); }
  bool has_whole_apron() const { return parts_.load(std::memory_order_acquire) == all_parts; }

  // For those who load it, before anyone else sees it.
  std::byte* samples() { return samples_.get(); }
  std::uint8_t* writable_validity();  // all valid at first
  void note_part(ApronPart part) { parts_.fetch_or(part.bit(), std::memory_order_release); }
  void make_invalid(std::string damage);

 private:
  friend void fill_apron(const Cell& cell, ApronPart part, const Cell& neighbour, ApronPart where);
  static constexpr std::uint16_t all_parts = 0x1ff;

  const SampleType type_;
  const int bands_;
  std::unique_ptr<std::byte[]> samples_;
  // These change when an apron part is filled, which no reader of other parts can tell.
  mutable std::unique_ptr<std::uint8_t[]> validity_;
  mutable std::atomic<bool> masked_{false};
  mutable std::atomic<std::uint16_t> parts_{ApronPart{}.bit()};
  std::string damage_;
};
using CellPtr = std::shared_ptr<const Cell>;

/// Fills a part of a cell's apron from the cell that lies at `where` from it: that of the part itself, or, where that
/// would lie beyond the level, the one that repeats the level's edge there.
/// Thread-safe: frames that fill the same part write the same bytes one after another.
void fill_apron(const Cell& cell, ApronPart part, const Cell& neighbour, ApronPart where);

/// Address of a cell in one source.
struct CellKey {
  std::uint64_t source = 0;  // CellSource::id()
  std::int32_t level = 0, col = 0, row = 0;
  friend auto operator<=>(const CellKey&, const CellKey&) = default;
};

}  // namespace nadir::tile
