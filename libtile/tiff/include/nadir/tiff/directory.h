#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace nadir::tiff {

/// How a tile's bytes are packed.
enum class Codec : std::uint8_t { None, Lzw, Deflate, Zstd, Lzma, Jpeg, WebP, Lerc };
std::string_view to_string(Codec codec);  // as GDAL names them: "DEFLATE"

/// What a row's samples were replaced by before packing (TIFF 6.0 section 14, Adobe's technical note 3).
enum class Predictor : std::uint8_t { None = 1, Horizontal = 2, FloatingPoint = 3 };

enum class Number : std::uint8_t { Unsigned, Signed, Float };

/// The colour model, as tag 262 numbers it; those that are read here.
enum class Photometric : std::uint16_t { MinIsBlack = 1, Rgb = 2, Palette = 3, TransparencyMask = 4, YCbCr = 6 };

/// A field of a directory: where its values lie in the file, those held inside the field too.
struct Field {
  std::uint16_t tag = 0, type = 0;
  std::uint64_t count = 0, place = 0;
};

/// Where the numbers of a long array lie: tile offsets, tile byte counts.
struct ArrayPlace {
  std::uint64_t place = 0, count = 0;
  std::uint32_t element_bytes = 0;  // 2, 4 or 8
};

/// All that it takes to decode a tile of a directory.
struct TileFormat {
  std::uint32_t tile_width = 0, tile_height = 0;  // texels
  std::uint32_t samples = 1;                      // of one texel, in all bands
  std::uint32_t bits = 8;                         // of a stored sample: 1 to 32, 64
  Number number = Number::Unsigned;
  bool separate = false;  // each band in tiles of its own, else all bands interleaved
  bool big_endian = false;
  Codec codec = Codec::None;
  Predictor predictor = Predictor::None;
  Photometric photometric = Photometric::MinIsBlack;
  std::uint8_t chroma_step = 1;  // texels to a colour difference of YCbCr, on both axes: 1 or 2. Tiles tell it too.
  std::vector<std::byte> jpeg_tables;  // shared by all tiles; may be empty
  int lerc_packing = 0;                // of LERC's blobs: 0 none, 1 DEFLATE, 2 Zstandard

  std::uint32_t samples_together() const { return separate ? 1 : samples; }  // of a texel, in one tile
  std::uint64_t row_bytes() const { return (std::uint64_t{tile_width} * samples_together() * bits + 7) / 8; }
  std::uint64_t tile_bytes() const { return row_bytes() * tile_height; }  // unpacked, as stored
};

/// One image of a file: a level, or the mask of one.
struct Directory {
  std::uint32_t width = 0, height = 0;  // texels, both below 2^31
  TileFormat format;
  bool reduced = false, mask = false;  // bits 0 and 2 of NewSubfileType
  bool strips = false;  // tiles as wide as the image, of which the last ends with it: its height is what is left
  std::vector<std::uint16_t> extra_samples;  // what the samples beyond the colours are; 1, 2: alpha
  ArrayPlace offsets, byte_counts;
  std::vector<Field> fields;

  std::uint32_t tiles_across() const { return (width - 1) / format.tile_width + 1; }
  std::uint32_t tiles_down() const { return (height - 1) / format.tile_height + 1; }
  std::uint64_t tiles_a_plane() const { return std::uint64_t{tiles_across()} * tiles_down(); }
  const Field* field(std::uint16_t tag) const;  // null where it has none
};

/// Tags of Directory::fields that a reader of maps asks for.
namespace tag {
inline constexpr std::uint16_t date_time = 306, color_map = 320, copyright = 33432, model_pixel_scale = 33550,
                               model_tie_points = 33922, model_transformation = 34264, geo_keys = 34735,
                               gdal_metadata = 42112, gdal_nodata = 42113, rational_coefficients = 50844;
}

}  // namespace nadir::tiff
