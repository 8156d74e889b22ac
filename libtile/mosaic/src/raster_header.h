#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "conversion.h"
#include "memory_file.h"
#include "nadir/base/result.h"
#include "nadir/tiff/directory.h"
#include "nadir/tile/map_description.h"
#include "open_files.h"

namespace nadir::mosaic {

using Metadata = std::vector<std::pair<std::string, std::string>>;

/// A raster that goes into a map, to be opened.
struct NamedRaster {
  std::string path;                          // what GDAL opens
  std::string label;                         // what the user called it, for messages
  std::shared_ptr<const MemoryFile> memory;  // holds the file at `path` where it is one we wrote
};

/// Where a TIFF's own directories hold what GDAL tells of a raster.
struct TiffLayout {
  std::uint32_t image = 0;  // index of the directory
  std::optional<std::uint32_t> mask;
  tiff::Directory image_directory, mask_directory;  // as of all files like it: without fields and places
};

struct BandHeader {
  Sample sample = Sample::U8;  // of complex ones, that of their magnitude
  bool complex = false;
  std::optional<double> nodata;  // as the sample holds it
  Palette palette;               // of indices; else empty
  Metadata metadata;             // statistics left out
  std::vector<std::string> categories;
};

/// What a raster's headers tell.
struct RasterHeader {
  SourceFile file;
  std::shared_ptr<const MemoryFile> memory;
  tile::MapDescription description;
  std::vector<BandHeader> bands;
  Metadata metadata;
  bool pixel_is_point = false;
  bool masked = false;             // validity lies in mask bands
  bool every_band_masked = false;  // each in one of its own
  std::optional<TiffLayout> tiff;  // where its tiles can be decoded without GDAL
};

/// NotFound, Malformed or Unsupported, naming it, where it cannot be read.
Result<RasterHeader> read_header(const NamedRaster& raster);

}  // namespace nadir::mosaic
