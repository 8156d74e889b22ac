#pragma once

#include <functional>
#include <span>

#include "nadir/base/result.h"
#include "nadir/tiff/directory.h"
#include "nadir/tiff/sample.h"

namespace nadir::tiff {

/// The type in which `decode_tile` hands out samples.
Sample decoded_sample(const TileFormat& format);

/// Takes row `y` of a tile: tile_width * samples_together() samples of type decoded_sample(), aligned for it. The
/// bytes are gone after the call.
using RowSink = std::function<void(std::uint32_t y, const std::byte* row)>;

/// Unpacks a tile and hands its first `rows` rows to `sink`, from the top.
///
/// Damaged, with the library's own words, where the bytes are not such a tile: too few, too many, another size. Never
/// reads beyond `packed`, and takes memory for one unpacked tile whatever the bytes claim. What a thread needs for it
/// is kept for its next tile.
Result<void> decode_tile(const TileFormat& format, std::span<const std::byte> packed, std::uint32_t rows,
                         const RowSink& sink);

/// Whether rows lie in the file as they are handed out: no codec, nothing to undo, aligned. Such a tile may be read in
/// parts: row y begins at its byte y * row_bytes().
bool rows_lie_as_decoded(const TileFormat& format);

/// Bytes beyond which a packed tile cannot be honest: no codec makes a tile much larger than it was.
std::uint64_t largest_packed_bytes(const TileFormat& format);

}  // namespace nadir::tiff
