#include "nadir/tiff/encode.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "codecs.h"
#include "nadir/tiff/decode.h"
#include "rows.h"
#include "scratch.h"

namespace nadir::tiff {
namespace {

constexpr int usual_deflate_level = 6, usual_zstd_level = 9, usual_lzma_level = 6;

tl::unexpected<Error> refuse(std::string why) { return fail(Error::Kind::Unsupported, std::move(why)); }

Result<int> level_of(const TileFormat& format, int asked) {
  const auto within = [&](int usual, int most) -> Result<int> {
    if (asked < 0 || asked > most)
      return fail(Error::Kind::Malformed,
                  fmt::format("level {}: {} has levels 1 to {}", asked, to_string(format.codec), most));
    return asked == 0 ? usual : asked;
  };
  switch (format.codec) {
    case Codec::Deflate:
      return within(usual_deflate_level, 12);
    case Codec::Zstd:
      return within(usual_zstd_level, 22);
    case Codec::Lzma:
      return within(usual_lzma_level, 9);
    case Codec::Lerc:
      return format.lerc_packing == 1 ? within(usual_deflate_level, 12) : within(usual_zstd_level, 22);
    default:
      return asked == 0
                 ? Result<int>(0)
                 : fail(Error::Kind::Malformed, fmt::format("level {}: {} has none", asked, to_string(format.codec)));
  }
}

Result<void> check_samples(const TileFormat& format) {
  const bool whole = format.bits == 8 || format.bits == 16 || format.bits == 32 || format.bits == 64;
  const bool bit = format.bits == 1 && format.samples == 1 && format.number == Number::Unsigned;
  if (!bit && (!whole || (format.number == Number::Float && format.bits < 32)))
    return refuse(fmt::format("samples of {} bits are not written", format.bits));
  if (format.big_endian) return refuse("only little-endian tiles are written");
  const bool bytes = format.bits == 8 && format.number == Number::Unsigned;
  switch (format.codec) {
    case Codec::Jpeg:
      if (!bytes || (format.samples != 1 && format.samples != 3))
        return refuse(
            fmt::format("JPEG holds 1 or 3 bands of unsigned bytes, found {} of {} bits", format.samples, format.bits));
      break;
    case Codec::WebP:
      if (!bytes || (format.samples != 3 && format.samples != 4))
        return refuse(
            fmt::format("WebP holds 3 or 4 bands of unsigned bytes, found {} of {} bits", format.samples, format.bits));
      break;
    case Codec::Lerc:
      if (!whole || (format.bits == 64 && format.number != Number::Float))
        return refuse(fmt::format("LERC holds integers of up to 32 bits and floats, found {} bits", format.bits));
      break;
    default:
      break;
  }
  const bool streams = format.codec == Codec::Deflate || format.codec == Codec::Zstd || format.codec == Codec::Lzw ||
                       format.codec == Codec::Lzma;
  if (format.separate && !streams && format.codec != Codec::None)
    return refuse(fmt::format("{} is written with interleaved bands only", to_string(format.codec)));
  if (format.predictor != Predictor::None && (!streams || bit))
    return refuse(fmt::format("{} has no predictor", to_string(format.codec)));
  if (format.predictor == Predictor::FloatingPoint && format.number != Number::Float)
    return refuse("the predictor for floats is for floats");
  return {};
}

Result<void> pack_stream(Codec codec, int level, std::span<const std::byte> tile, RawBytes& out) {
  switch (codec) {
    case Codec::Lzw:
      return pack_lzw(tile, out);
    case Codec::Zstd:
      return pack_zstd(tile, level, out);
    case Codec::Lzma:
      return pack_lzma(tile, level, out);
    default:
      return pack_deflate(tile, level, out);
  }
}

}  // namespace

struct TileEncoder::State {
  TileFormat format;
  Packing packing;
  int level = 0;

  bool rows_are_plain() const { return format.predictor == Predictor::None && format.bits != 1; }

  /// Writes a row as it is packed.
  void put_row(const std::byte* row, std::byte* to) const {
    if (rows_are_plain())
      std::memcpy(to, row, static_cast<std::size_t>(format.row_bytes()));
    else
      predict_row(format, row, to);
  }

  void put_rows(const std::byte* first_row, std::size_t stride, std::byte* to) const {
    for (std::uint32_t y = 0; y < format.tile_height; ++y) put_row(first_row + y * stride, to + y * format.row_bytes());
  }

  void append_rows(const std::byte* first_row, std::size_t stride, RawBytes& out) const {
    const std::size_t begin = out.size();
    out.resize(begin + static_cast<std::size_t>(format.tile_bytes()));
    put_rows(first_row, stride, out.data() + begin);
  }

  /// Rows as they are packed, without gaps: the tile itself where they already are.
  std::span<const std::byte> rows(const std::byte* first_row, std::size_t stride) const {
    const auto bytes = static_cast<std::size_t>(format.tile_bytes());
    if (rows_are_plain() && stride == format.row_bytes()) return {first_row, bytes};
    static thread_local Scratch scratch;
    const std::span<std::byte> tile = scratch.take(bytes);
    put_rows(first_row, stride, tile.data());
    return tile;
  }
};

Result<TileEncoder> TileEncoder::create(TileFormat format, const Packing& packing) {
  if (const auto ok = check_samples(format); !ok) return fail(ok);
  const auto level = level_of(format, packing.level);
  if (!level) return fail(level);
  const bool pictures = format.codec == Codec::Jpeg || format.codec == Codec::WebP;
  if (pictures && (packing.quality < 1 || packing.quality > 100))
    return fail(Error::Kind::Malformed, fmt::format("quality {}: expected 1 to 100", packing.quality));
  if (!(packing.max_error >= 0) || std::isinf(packing.max_error))
    return fail(Error::Kind::Malformed,
                fmt::format("largest error {}: expected a finite number of at least 0", packing.max_error));
  if (format.codec == Codec::Jpeg) {
    if (format.samples == 3) {
      format.photometric = Photometric::YCbCr;
      format.chroma_step = packing.subsample_chroma ? 2 : 1;
    }
    auto tables = make_jpeg_tables(format, packing.quality);
    if (!tables) return fail(tables);
    format.jpeg_tables = std::move(*tables);
  }
  return TileEncoder(std::make_shared<const State>(State{std::move(format), packing, *level}));
}

const TileFormat& TileEncoder::format() const { return state_->format; }

Result<std::size_t> TileEncoder::append(const std::byte* first_row, std::size_t stride, RawBytes& out) const {
  const auto& [format, packing, level] = *state_;
  const std::size_t begin = out.size();
  Result<void> done;
  switch (format.codec) {
    case Codec::None:
      state_->append_rows(first_row, stride, out);
      break;
    case Codec::Jpeg:
      done = pack_jpeg(format, packing.quality, first_row, stride, out);
      break;
    case Codec::WebP:
      done = pack_webp(format, packing.quality, first_row, stride, out);
      break;
    case Codec::Lerc:
      if (format.lerc_packing == 0) {
        done = pack_lerc(format, packing.max_error, state_->rows(first_row, stride), out);
      } else {
        static thread_local RawBytes blob;
        blob.clear();
        done = pack_lerc(format, packing.max_error, state_->rows(first_row, stride), blob);
        if (done) done = pack_stream(format.lerc_packing == 1 ? Codec::Deflate : Codec::Zstd, level, blob, out);
      }
      break;
    default:
      done = pack_stream(format.codec, level, state_->rows(first_row, stride), out);
  }
  if (!done) {
    out.resize(begin);  // nothing of a tile that failed
    return fail(done);
  }
  return out.size() - begin;
}

}  // namespace nadir::tiff
