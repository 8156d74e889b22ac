#pragma once

#include <memory>
#include <span>
#include <vector>

#include "nadir/tile/cell_source.h"
#include "validity.h"

namespace nadir::tile {

/// Lays the rows of a block out into its cells.
class BlockWriter {
 public:
  /// `stored`: type of the rows that will come; `wanted` as in CellSource::load.
  BlockWriter(const CellSource& source, SampleType stored, const CellBlock& block,
              std::span<const std::uint8_t> wanted);

  /// Row `y` of the block from its top, all of its texels; `valid` is null where all are, but for nodata.
  void row(std::uint32_t y, const std::byte* samples, const std::uint8_t* valid);

  /// Once all rows have come: the cells.
  std::vector<std::shared_ptr<Cell>> take() { return std::move(cells_); }

 private:
  const CellSource& source_;
  const SampleType stored_;
  const CellBlock block_;
  const NodataRule nodata_;
  int width_;  // texels of the block
  std::size_t texel_bytes_;
  std::vector<std::shared_ptr<Cell>> cells_;
  std::vector<float> power_;         // a row of Domain::Decibel
  std::vector<std::uint8_t> valid_;  // a row
};

}  // namespace nadir::tile
