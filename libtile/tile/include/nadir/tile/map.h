#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "nadir/base/byte_source.h"
#include "nadir/base/result.h"
#include "nadir/geodesy/geodetic.h"
#include "nadir/geodesy/projection.h"
#include "nadir/tile/map_description.h"

namespace nadir::tile {

class Raster;
class TiffTiles;

/// A rectangle of texels of one level, from (x, y) at its top left; inside the level.
struct Window {
  std::int32_t x = 0, y = 0, width = 0, height = 0;
};

/// Texels of a window: rows from the top, bands interleaved.
struct Texels {
  SampleType type = SampleType::UInt8;
  int bands = 0;
  Window window;
  std::vector<std::byte> samples;      // window.height * window.width * bands, native byte order
  std::vector<std::uint8_t> validity;  // window.height * window.width, 1 valid, 0 not; empty where all are valid
};

/// What a map has cost so far.
struct MapCounters {
  std::int64_t windows_read = 0;  // of a tiled TIFF, whole tiles
  std::int64_t samples_read = 0;  // texels times bands
};

/// A georeferenced raster with levels, on disk.
///
/// Whatever GDAL opens; tiled TIFFs are decoded without it. Texels are read when asked for, and only the bands asked
/// for. A texel is invalid where the file's mask (of any band read, where each has its own) or alpha band is below
/// half, where every band read equals its nodata value, or where any sample read is not finite. Cheap to copy: copies
/// share the open file. Thread-safe.
class Map {
 public:
  /// Fails where there is no such raster, or it lacks a georeference that PROJ can relate to WGS-84.
  static Result<Map> open(const std::string& path);
  /// A tiled TIFF whose bytes come from anywhere.
  static Result<Map> open(std::shared_ptr<const ByteSource> source);

  const MapDescription& description() const;
  const std::vector<Level>& levels() const { return description().levels; }
  std::int32_t width() const { return levels().front().width; }
  std::int32_t height() const { return levels().front().height; }

  const geodesy::Projection& projection() const;
  const Eigen::Affine2d& crs_from_texel() const;
  const Eigen::Affine2d& texel_from_crs() const;

  /// Whether its columns go once around the Earth, within a hundredth of a texel: then what lies left of the first
  /// column is the last one.
  bool goes_around() const;

  /// The place at the middle of the raster, on the ellipsoid.
  const geodesy::Geodetic& center() const;

  /// Side in true metres on the ellipsoid of a level-0 texel at the centre, along columns (x) and rows (y).
  /// A Web-Mercator metre is not a metre and a degree is not square: this is measured on the ground.
  const Eigen::Vector2d& texel_size_m() const;

  /// Reads `bands` (numbers from 1, data bands) of a window. Damaged where it cannot be decoded; other windows may be.
  Result<Texels> read(int level, const Window& window, std::span<const int> bands) const;

  /// The type in which `bands` are read: their own where they agree, else Float32.
  Result<SampleType> sample_type(std::span<const int> bands) const;

  /// Root of the mean square that the texels in a window of a level lose when the next coarser one stands for them, over
  /// whole stored tiles and the bands asked for: what the builder stored. Radar in dB: of power. Empty of the coarsest
  /// level, and where the file does not tell.
  std::optional<double> loss(int level, const Window& window, std::span<const int> bands) const;

  MapCounters counters() const;

 private:
  friend class CellSource;
  static Result<Map> over(std::unique_ptr<Raster> raster);
  const TiffTiles* tiles() const;  // null where tiles are not decoded here
  void count_read(std::int64_t texels, std::size_t bands) const;

  struct Shared;
  explicit Map(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) {}
  std::shared_ptr<Shared> shared_;
};

/// Bounds the memory in which GDAL keeps decoded blocks, for the whole process. A GDAL_CACHEMAX set by the user wins.
void limit_gdal_block_cache(std::uint64_t bytes);

}  // namespace nadir::tile
