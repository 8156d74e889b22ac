#pragma once

#include "fault_list.h"
#include "nadir/pyramid/check.h"
#include "nadir/tiff/tiff_file.h"

namespace nadir::pyramid {

/// Looks at directories and tables of tiles, and at what lies around the tiles; fills in sizes and counts of levels.
/// The directories of the levels, finest first.
std::vector<std::uint32_t> check_structure(const tiff::TiffFile& file, CheckReport& report, FaultList& faults);

}  // namespace nadir::pyramid
