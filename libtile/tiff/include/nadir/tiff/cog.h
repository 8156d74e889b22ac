#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "nadir/base/raw_bytes.h"
#include "nadir/base/result.h"
#include "nadir/tiff/directory.h"
#include "nadir/tiff/encode.h"

namespace nadir::tiff {

/// A field of a directory to be written: values in little-endian order, as the type (TIFF 6.0 section 2) lays them out.
struct NewField {
  std::uint16_t tag = 0, type = 0;
  std::uint64_t count = 0;
  std::vector<std::byte> values;
};

/// Width and height in texels of one level.
struct CogLevel {
  std::uint32_t width = 0, height = 0;
};

/// A cloud-optimized GeoTIFF before it has tiles.
struct CogImage {
  TileFormat format;                         // of imagery in all levels
  std::vector<std::uint16_t> extra_samples;  // 2: alpha not multiplied into the colours, 0: unspecified
  std::optional<TileFormat> mask;            // of 1 bit, same tile size, where validity lies in masks of its own
  std::vector<CogLevel> levels;              // level 0 first
  std::vector<NewField> fields;              // of level 0 beyond what tiles need: georeference, metadata
  std::vector<NewField> shared_fields;       // of all levels: nodata, colours
};

/// Bytes of each packed tile of a level, row by row, of one band after the other where they are separate; 0 where there
/// is none. `mask` is empty where the image has none.
struct TileSizes {
  std::vector<std::uint32_t> imagery, mask;
};

/// Root of the mean square that a tile loses in the next coarser level, per data band; tiles row by row, bands
/// interleaved. Empty for the coarsest level.
using TileLosses = std::vector<float>;

/// Where everything lies in the file.
struct CogArrangement {
  bool big = false;                                       // BigTIFF: 32 bits are not enough
  std::uint64_t data_begin = 0;                           // the header lies before
  std::vector<std::vector<std::uint64_t>> imagery, mask;  // a level's offsets of packed tiles; 0 where there is none
  std::vector<std::uint64_t> losses;                      // a level's offset of its TileLosses; 0 where it has none
  std::uint64_t file_bytes = 0;
};

/// The private tag of a level's TileLosses: offset and count of floats.
namespace tag {
inline constexpr std::uint16_t tile_losses = 65110;
}

/// Every tile is led by its size in 4 bytes and followed by its last 4 bytes once more, as GDAL's notes promise.
inline constexpr std::uint64_t tile_leader_bytes = 4, tile_trailer_bytes = 4;

/// Packs a tile, as TileEncoder::append takes it, and appends it between its leader and its trailer. Its size in bytes
/// without them.
Result<std::uint32_t> append_tile(const TileEncoder& encoder, const std::byte* first_row, std::size_t stride,
                                  RawBytes& out);

/// Lays a file out: header, then tiles from the coarsest level to level 0, each level row by row and each tile's mask
/// behind it, then losses.
/// `spare_bytes`: by which fields may still grow until `header` is called, where tiles are written before.
CogArrangement arrange(const CogImage& image, std::span<const TileSizes> sizes, std::span<const TileLosses> losses,
                       std::uint64_t spare_bytes);

/// All before data_begin: signature, notes for GDAL, directories, tables of tiles. Source of the layout: what GDAL's
/// COG driver writes, which its validator and readers of byte ranges expect. OverBudget where fields have grown by more
/// than the spare bytes.
Result<std::vector<std::byte>> header(const CogImage& image, std::span<const TileSizes> sizes,
                                      std::span<const TileLosses> losses, const CogArrangement& arrangement);

}  // namespace nadir::tiff
