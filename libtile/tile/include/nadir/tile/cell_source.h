#pragma once

#include <cstdint>
#include <vector>

#include "nadir/tile/cell.h"
#include "nadir/tile/map.h"

namespace nadir::tile {

/// How stored values become what may be averaged.
enum class Domain {
  Linear,   // stored values themselves
  Decibel,  // stored as dB, held and averaged in power, as Float32
};

/// Cells of some bands of a map, in one domain.
/// Thread-safe.
class CellSource {
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

  /// Reads a cell. Never calls the cache.
  Result<CellPtr> load(int level, std::int32_t col, std::int32_t row) const;

 private:
  CellSource(const Map& map, std::vector<int> bands, SampleType type, Domain domain);

  std::uint64_t id_;  // unique in the process
  Map map_;
  std::vector<int> bands_;
  SampleType type_;
  Domain domain_;
};

}  // namespace nadir::tile
