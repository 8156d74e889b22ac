#include "nadir/tiff/decode.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "codecs.h"
#include "rows.h"
#include "scratch.h"

namespace nadir::tiff {
namespace {

Result<void> unpack_lerc_stream(const TileFormat& format, std::span<const std::byte> packed, std::span<std::byte> out) {
  if (format.lerc_packing == 0) return unpack_lerc(format, packed, out);
  // The stream around the blob does not say how large that is.
  static thread_local Scratch scratch;
  const std::span<std::byte> blob = scratch.take(largest_packed_bytes(format));
  const auto size = format.lerc_packing == 1 ? unpack_deflate_some(packed, blob) : unpack_zstd_some(packed, blob);
  if (!size) return fail(size);
  auto done = unpack_lerc(format, blob.first(*size), out);
  scratch.trim();
  return done;
}

Result<void> unpack(const TileFormat& format, std::span<const std::byte> packed, std::span<std::byte> out) {
  switch (format.codec) {
    case Codec::Lzw:
      return unpack_lzw(packed, out);
    case Codec::Deflate:
      return unpack_deflate(packed, out);
    case Codec::Zstd:
      return unpack_zstd(packed, out);
    case Codec::Lzma:
      return unpack_lzma(packed, out);
    case Codec::Jpeg:
      return unpack_jpeg(format, packed, out);
    case Codec::WebP:
      return unpack_webp(format, packed, out);
    case Codec::Lerc:
      return unpack_lerc_stream(format, packed, out);
    case Codec::None:
      break;
  }
  std::copy_n(packed.begin(), out.size(), out.begin());
  return {};
}

}  // namespace

std::size_t size_bytes(Sample sample) {
  return with_sample(sample, [](auto s) { return sizeof s; });
}

Sample decoded_sample(const TileFormat& format) {
  if (format.number == Number::Float) return format.bits == 64 ? Sample::F64 : Sample::F32;
  const bool is_signed = format.number == Number::Signed;
  if (format.bits <= 8) return is_signed ? Sample::I8 : Sample::U8;
  if (format.bits <= 16) return is_signed ? Sample::I16 : Sample::U16;
  if (format.bits <= 32) return is_signed ? Sample::I32 : Sample::U32;
  return is_signed ? Sample::I64 : Sample::U64;
}

bool rows_lie_as_decoded(const TileFormat& format) {
  return format.codec == Codec::None && rows_are_plain(format) &&
         format.row_bytes() % size_bytes(decoded_sample(format)) == 0;
}

std::uint64_t largest_packed_bytes(const TileFormat& format) {
  // LZW at its worst spends 12 bits on a byte; headers and tables of small pictures are what the constant is for.
  return format.tile_bytes() * 2 + (64 << 10);
}

Result<void> decode_tile(const TileFormat& format, std::span<const std::byte> packed, std::uint32_t rows,
                         const RowSink& sink) {
  static thread_local Scratch unpacked_scratch, row_scratch;
  const auto row_bytes = static_cast<std::size_t>(format.row_bytes());
  rows = std::min(rows, format.tile_height);

  const bool plain = rows_are_plain(format);
  const std::size_t alignment = size_bytes(decoded_sample(format));
  if (rows_lie_as_decoded(format) && reinterpret_cast<std::uintptr_t>(packed.data()) % alignment == 0) {
    if (packed.size() < row_bytes * rows)
      return damaged(fmt::format("{} bytes of {}", packed.size(), format.tile_bytes()));
    for (std::uint32_t y = 0; y < rows; ++y) sink(y, packed.data() + y * row_bytes);
    return {};
  }

  // Before memory is taken: a strip that is not packed may claim any height.
  if (format.codec == Codec::None && packed.size() < format.tile_bytes())
    return damaged(fmt::format("{} bytes of {}", packed.size(), format.tile_bytes()));
  const std::span<std::byte> unpacked = unpacked_scratch.take(static_cast<std::size_t>(format.tile_bytes()));
  if (auto ok = unpack(format, packed, unpacked); !ok) return ok;
  // A row of its own for what is restored: rows of odd widths start anywhere.
  const std::size_t aligned = (row_bytes + 7) / 8 * 8;
  const std::span<std::byte> room = row_scratch.take(2 * aligned + wide_row_bytes(format));
  const bool in_place = row_bytes % 8 == 0;
  for (std::uint32_t y = 0; y < rows; ++y) {
    std::byte* row = unpacked.data() + y * row_bytes;
    if (!in_place) {
      std::copy_n(row, row_bytes, room.data());
      row = room.data();
    }
    sink(y, plain ? row : restore_row(format, row, room.data() + aligned, room.data() + 2 * aligned));
  }
  unpacked_scratch.trim();
  return {};
}

}  // namespace nadir::tiff
