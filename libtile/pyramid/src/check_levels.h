#pragma once

#include "fault_list.h"
#include "nadir/mosaic/source.h"
#include "nadir/pyramid/check.h"
#include "nadir/tiff/tiff_file.h"
#include "reduction.h"

namespace nadir::pyramid {

/// By how much a level may differ from what the one before gives.
struct LevelBound {
  enum class Kind { Same, Greatest, RmsOfBrightness, Untold } kind = Kind::Same;
  double value = 0;  // in stored units; of Kind::Greatest without the rounding of integers
};

/// Of tiles packed by `format`; `max_error`: LERC's, in stored units.
LevelBound level_bound(const tiff::TileFormat& format, double max_error, const mosaic::TexelType& type,
                       const Reduction& reduction);
std::string describe(const LevelBound& bound);

/// A map's levels, finest first.
struct LevelsToCheck {
  std::vector<std::shared_ptr<const mosaic::Source>> sources;
  std::shared_ptr<const tiff::TiffFile> tiff;  // null: tiles are not looked up
  std::vector<std::uint32_t> directories;      // of `tiff`, one a level
  mosaic::TexelType type;
  std::optional<Reduction> reduction;  // without one nothing is compared
  LevelBound bound;
};

/// Reads every level wherever tiles are stored, which decodes all of them, and compares each with what the level before
/// gives, but where its size is not half of that one, rounded up.
void check_levels(const LevelsToCheck& levels, const CheckOptions& options, CheckReport& report, FaultList& faults);

}  // namespace nadir::pyramid
