#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "nadir/tile/cell.h"
#include "nadir/tile/map.h"

namespace nadir::tile {

/// How stored values become what may be averaged.
enum class Domain {
  Linear,   // stored values themselves
  Decibel,  // stored as dB, held and averaged in power, as Float32
};

/// Cells that are loaded together, since one stored tile holds them: cols by rows of one level.
struct CellBlock {
  std::int32_t level = 0, col = 0, row = 0;  // of its first cell
  std::int32_t cols = 1, rows = 1;

  std::size_t size() const { return static_cast<std::size_t>(cols) * static_cast<std::size_t>(rows); }
  /// Place of a cell of it in a list of its cells, row by row.
  std::size_t index(std::int32_t cell_col, std::int32_t cell_row) const {
    return static_cast<std::size_t>(cell_row - row) * static_cast<std::size_t>(cols) +
           static_cast<std::size_t>(cell_col - col);
  }
};

struct TileKey;

/// What of a block was brought from far away before it is decoded. A value that only its source can read.
class FetchedBlock;

/// Cells of some bands of a map, in one domain.
/// Thread-safe.
class CellSource : public std::enable_shared_from_this<CellSource> {
 public:
  /// `bands`: data bands, numbers from 1, each at most once; all of them where empty.
  static Result<std::shared_ptr<const CellSource>> make(const Map& map, std::vector<int> bands, Domain domain);

  std::uint64_t id() const { return id_; }
  const Map& map() const { return map_; }
  const std::vector<int>& bands() const { return bands_; }
  SampleType type() const { return type_; }
  Domain domain() const { return domain_; }

  /// Memory that a cell takes at most, known before it is read.
  std::uint64_t cell_bytes() const;

  /// The block that a cell is loaded with: a stored tile where that is made of whole cells, else the cell alone.
  CellBlock block_of(int level, std::int32_t col, std::int32_t row) const;

  /// Whether blocks come from far away, so that `fetch` saves journeys.
  bool is_remote() const;
  /// Brings several blocks at once. In their order, each with its own error; null for one that `load` has to read.
  std::vector<Result<std::shared_ptr<const FetchedBlock>>> fetch(std::span<const CellBlock> blocks) const;

  /// Loads the cells of a block for which `wanted` is set (all where it is empty), row by row, null for the others.
  /// `fetched`: from `fetch`, or null to read now. Damaged where its tile cannot be decoded. Never calls the cache.
  Result<std::vector<std::shared_ptr<Cell>>> load(const CellBlock& block, std::span<const std::uint8_t> wanted = {},
                                                  const FetchedBlock* fetched = nullptr) const;

  /// Cells that stand for a block that is damaged: all invalid, saying why.
  std::vector<std::shared_ptr<Cell>> damaged(const CellBlock& block, std::span<const std::uint8_t> wanted,
                                             const std::string& why) const;

 private:
  CellSource(const Map& map, std::vector<int> bands, SampleType type, Domain domain);
  std::optional<TileKey> tile_of(const CellBlock& block) const;  // empty where it is no stored tile

  std::uint64_t id_;  // unique in the process
  Map map_;
  std::vector<int> bands_;
  SampleType stored_;  // as the map reads them
  SampleType type_;    // as cells hold them
  Domain domain_;
};

}  // namespace nadir::tile
