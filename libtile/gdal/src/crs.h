#pragma once

#include "nadir/geodesy/crs_module.h"

namespace nadir::gdal {

/// A CRS from EPSG:code, WKT, PROJ string: what PROJ knows. Refuses those that are not of the Earth's surface.
Result<std::shared_ptr<const geodesy::LibraryCrs>> open_crs(const std::string& definition);

/// Height of the EGM96 geoid above the ellipsoid, metres. NotFound where PROJ lacks its grid.
Result<double> geoid_height_m(double lat_rad, double lon_rad);

}  // namespace nadir::gdal
