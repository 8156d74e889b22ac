// Any bytes as a packed tile of one codec. The first byte chooses the tile's format.
#include "memory_source.h"
#include "nadir/tiff/decode.h"

using namespace nadir;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  const std::uint8_t choice = data[0];
  tiff::TileFormat format;
  format.tile_width = format.tile_height = 32;
  format.codec = tiff::Codec::NADIR_FUZZ_CODEC;
  const bool picture = format.codec == tiff::Codec::Jpeg || format.codec == tiff::Codec::WebP;
  const bool lerc = format.codec == tiff::Codec::Lerc;
  format.samples = 1 + (choice & 3);
  if (format.codec == tiff::Codec::WebP) format.samples = 3 + (choice & 1);
  if (format.codec == tiff::Codec::Jpeg && format.samples == 3) format.photometric = tiff::Photometric::YCbCr;
  if (!picture) {
    constexpr std::uint32_t widths[8] = {8, 16, 32, 12, 24, 1, 32, 16};
    format.bits = widths[(choice >> 2) & 7];
    if (lerc && (format.bits == 12 || format.bits == 24 || format.bits == 1)) format.bits = 32;
    if (((choice >> 2) & 7) == 6) format.number = tiff::Number::Float;
    if (!lerc && format.number == tiff::Number::Float)
      format.predictor = tiff::Predictor::FloatingPoint;
    else if (!lerc && (choice & 32) && (format.bits == 8 || format.bits == 16 || format.bits == 32))
      format.predictor = tiff::Predictor::Horizontal;
    format.big_endian = !lerc && (choice & 64);
    if (lerc) format.lerc_packing = choice >> 6 & 1 ? 2 : choice >> 7;
  }
  // A copy as long as it is, so that a byte read beyond it is seen
  const auto* first = reinterpret_cast<const std::byte*>(data) + 1;
  const std::vector<std::byte> packed(first, first + size - 1);
  std::uint64_t sum = 0;
  (void)tiff::decode_tile(format, packed, format.tile_height, [&](std::uint32_t, const std::byte* row) {
    const std::size_t bytes = 32 * format.samples * size_bytes(decoded_sample(format));
    for (std::size_t i = 0; i < bytes; ++i) sum += static_cast<std::uint64_t>(row[i]);
  });
  return sum == 0x123456789;  // so that every byte is read
}
