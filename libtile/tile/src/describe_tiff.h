#pragma once

#include "nadir/tiff/tiff_file.h"
#include "nadir/tile/map_description.h"

namespace nadir::tile {

/// What a TIFF's own headers tell, for files that need no other library to be understood: levels and masks in the file,
/// a CRS that is named by a code with a closed form, or none. Unsupported, saying what, for all others.
Result<MapDescription> describe_tiff(const tiff::TiffFile& file);

}  // namespace nadir::tile
