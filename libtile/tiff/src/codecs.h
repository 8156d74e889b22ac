#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "nadir/base/raw_bytes.h"
#include "nadir/base/result.h"
#include "nadir/tiff/directory.h"

namespace nadir::tiff {

/// What a codec says of bytes that are not what it makes: the decoder adds file and tile.
inline tl::unexpected<Error> damaged(std::string what) { return fail(Error::Kind::Damaged, std::move(what)); }

// Each fills all of `out` from `packed`, or says what is wrong. A thread's state is kept for its next tile.
Result<void> unpack_lzw(std::span<const std::byte> packed, std::span<std::byte> out);
Result<void> unpack_deflate(std::span<const std::byte> packed, std::span<std::byte> out);
Result<void> unpack_zstd(std::span<const std::byte> packed, std::span<std::byte> out);
Result<void> unpack_lzma(std::span<const std::byte> packed, std::span<std::byte> out);

// As above where the packed bytes alone tell how many they hold: at most all of `out`. The number of bytes.
Result<std::size_t> unpack_deflate_some(std::span<const std::byte> packed, std::span<std::byte> out);
Result<std::size_t> unpack_zstd_some(std::span<const std::byte> packed, std::span<std::byte> out);

// Pictures: `out` becomes rows of interleaved samples of the tile, in native byte order.
Result<void> unpack_jpeg(const TileFormat& format, std::span<const std::byte> packed, std::span<std::byte> out);
Result<void> unpack_webp(const TileFormat& format, std::span<const std::byte> packed, std::span<std::byte> out);
Result<void> unpack_lerc(const TileFormat& format, std::span<const std::byte> packed, std::span<std::byte> out);

// Each packs all of `tile` and appends it to `out`. The same input gives the same bytes.
Result<void> pack_lzw(std::span<const std::byte> tile, RawBytes& out);
Result<void> pack_deflate(std::span<const std::byte> tile, int level, RawBytes& out);
Result<void> pack_zstd(std::span<const std::byte> tile, int level, RawBytes& out);
Result<void> pack_lzma(std::span<const std::byte> tile, int level, RawBytes& out);

// Pictures: rows of interleaved samples in native byte order, `stride` bytes apart.
/// What all JPEG tiles of a format share: a stream of tables alone.
Result<std::vector<std::byte>> make_jpeg_tables(const TileFormat& format, int quality);
Result<void> pack_jpeg(const TileFormat& format, int quality, const std::byte* rows, std::size_t stride, RawBytes& out);
Result<void> pack_webp(const TileFormat& format, int quality, const std::byte* rows, std::size_t stride, RawBytes& out);
/// `tile`: its rows without gaps.
Result<void> pack_lerc(const TileFormat& format, double max_error, std::span<const std::byte> tile, RawBytes& out);

/// LERC's numbers for types of samples.
unsigned lerc_type(const TileFormat& format);

}  // namespace nadir::tiff
