// Any bytes as a TIFF: its directories, its tables, and the first tiles of each directory. Either an error or a
// picture.
#include "memory_source.h"
#include "nadir/tiff/decode.h"
#include "nadir/tiff/tiff_file.h"

using namespace nadir;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto* first = reinterpret_cast<const std::byte*>(data);
  const auto file = tiff::TiffFile::open(std::make_shared<fuzz::MemorySource>(std::vector(first, first + size)));
  if (!file) return 0;
  const auto& directories = (*file)->directories();
  constexpr std::uint64_t most_bytes = 1 << 20;  // of a tile: larger ones say nothing new
  for (std::uint32_t d = 0; d < std::min<std::size_t>(directories.size(), 4); ++d) {
    for (const tiff::Field& field : directories[d].fields) {
      (void)(*file)->text(field);
      (void)(*file)->numbers(field);
    }
    const tiff::TileFormat& format = directories[d].format;
    if (format.tile_bytes() > most_bytes) continue;
    const std::vector<tiff::TileAddress> tiles = {{d, 0, 0, 0},
                                                  {d, format.separate ? format.samples - 1 : 0,
                                                   directories[d].tiles_across() - 1, directories[d].tiles_down() - 1}};
    for (const auto& place : (*file)->locate(tiles)) {
      if (!place) continue;
      std::vector<std::byte> packed(place->size);
      if (!(*file)->source().read(place->offset, packed)) __builtin_trap();  // `locate` vouches for it
      std::uint64_t sum = 0;
      (void)tiff::decode_tile(format, packed, format.tile_height, [&](std::uint32_t, const std::byte* row) {
        const std::size_t bytes =
            std::size_t{format.tile_width} * format.samples_together() * size_bytes(decoded_sample(format));
        for (std::size_t i = 0; i < bytes; ++i) sum += static_cast<std::uint64_t>(row[i]);
      });
      if (sum == 0x123456789) return 1;  // so that every byte is read
    }
  }
  return 0;
}
