#pragma once

#include <filesystem>

#include "nadir/base/result.h"
#include "nadir/render/truth_planes.h"

namespace nadir::record {

/// Writes truth planes as one TIFF of six bands of float64, as wide types lose nothing of narrow ones: longitude_deg,
/// latitude_deg, height_ellipsoid_m, range_m, incidence_deg, ground_sample_distance_m. The file names them, with units,
/// as GDAL does. NaN, declared as nodata, where no ground is seen. Each band in tiles of its own of 256 pixels a side,
/// deflate with the predictor for floats.
///
/// Missing folders are made; afterwards the file is whole, or what it was before. The same planes give the same bytes.
Result<void> write_truth_planes(const std::filesystem::path& path, const render::TruthPlanes& planes);

/// Reads what `write_truth_planes` wrote, to the last bit. Malformed where it is another file, Damaged where it broke.
Result<render::TruthPlanes> read_truth_planes(const std::filesystem::path& path);

}  // namespace nadir::record
