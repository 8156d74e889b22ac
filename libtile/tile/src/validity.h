#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "nadir/tile/map_description.h"

namespace nadir::tile {

/// The rule of what is no data, for samples of some bands of a map: all bands read equal nodata, or one is not finite.
class NodataRule {
 public:
  NodataRule(const MapDescription& map, std::span<const int> bands, SampleType type);

  /// Whether no sample can break it, so that nothing needs to be looked at.
  bool never() const { return !every_band_has_nodata_ && type_ != SampleType::Float32; }

  /// Clears `valid` where texels, bands interleaved, break the rule.
  void check(const std::byte* samples, std::size_t texels, std::uint8_t* valid) const;

 private:
  SampleType type_;
  std::size_t bands_;
  bool every_band_has_nodata_ = true;
  std::vector<double> nodata_;  // representable in the type
};

}  // namespace nadir::tile
