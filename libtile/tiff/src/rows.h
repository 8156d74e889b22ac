#pragma once

#include <cstddef>
#include <cstdint>

#include "nadir/tiff/decode.h"

namespace nadir::tiff {

/// Undoes a row of what packing did to it: predictor and byte order, in place; then odd widths, into `wide`.
/// `row`: format.row_bytes() bytes as unpacked, aligned for 8 bytes; `scratch`: as many. The result is decoded samples:
/// `row` itself where widths are whole, else `wide`, which holds tile_width * samples_together() of them.
const std::byte* restore_row(const TileFormat& format, std::byte* row, std::byte* scratch, std::byte* wide);

/// The inverse: a row of decoded samples as it is packed, into the format.row_bytes() bytes of `packed`. Little-endian;
/// samples of 1, 8, 16, 32 or 64 bits.
void predict_row(const TileFormat& format, const std::byte* row, std::byte* packed);

/// Whether `restore_row` would leave rows as they are.
bool rows_are_plain(const TileFormat& format);

/// Bytes that `wide` must hold; 0 where it is not used.
std::size_t wide_row_bytes(const TileFormat& format);

/// Sums bytes along a row, each with the one `step` before it, in place: 8-bit Predictor::Horizontal.
/// All kernels give the same bits.
void accumulate_bytes(std::uint8_t* row, std::size_t bytes, std::size_t step);
namespace scalar {
void accumulate_bytes(std::uint8_t* row, std::size_t bytes, std::size_t step);
}

}  // namespace nadir::tiff
