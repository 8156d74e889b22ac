#pragma once

#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <Eigen/Geometry>
#include <memory>
#include <string>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/tile/map_description.h"
#include "scratch.h"

namespace nadir::pyramid {

/// One raster that goes into a map, as its headers tell.
struct Source {
  std::string path;   // what GDAL opens
  std::string label;  // what the user called it, for messages
  tile::MapDescription description;
  GDALDataType type = GDT_Unknown;           // of all bands
  std::vector<int> bands;                    // those to take, numbers from 1, alpha last
  bool alpha = false;                        // the last of `bands` is alpha
  std::shared_ptr<const MemoryFile> memory;  // holds the file at `path` where it is one we wrote
};

/// Opens each source and checks that it can go into a map, alone and beside the first.
/// `bands`: names or numbers, looked up in the first; `zoom`: of folders.
Result<std::vector<Source>> open_sources(const std::vector<std::string>& names, const std::vector<std::string>& bands,
                                         std::optional<int> zoom);

}  // namespace nadir::pyramid
