#include "tiff_raster.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>

#include "describe_tiff.h"
#include "nadir/tile/cell.h"
#include "tiff_tiles.h"

namespace nadir::tile {
namespace {

/// Files beside a TIFF in which GDAL keeps what it adds: then the TIFF alone does not tell all.
bool has_companions(const std::string& path) {
  static constexpr std::array suffixes = {".aux.xml", ".ovr", ".msk", ".OVR", ".MSK"};
  return std::any_of(suffixes.begin(), suffixes.end(), [&](const char* suffix) {
    std::error_code error;
    return std::filesystem::exists(path + suffix, error);
  });
}

class TiffRaster : public Raster {
 public:
  TiffRaster(MapDescription description, std::shared_ptr<const TiffTiles> tiles)
      : Raster(std::move(description)), tiles_(std::move(tiles)) {}

  const TiffTiles* tiles() const override { return tiles_.get(); }

  /// Tile by tile.
  Result<Texels> read(int level, const Window& window, std::span<const int> bands, SampleType type) const override {
    const Level& size = description().levels[static_cast<std::size_t>(level)];
    Texels texels{type, static_cast<int>(bands.size()), window, {}, {}};
    const std::size_t texel = bands.size() * size_bytes(type);
    texels.samples.resize(static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height) * texel);
    const int last_col = (window.x + window.width - 1) / size.tile_width,
              last_row = (window.y + window.height - 1) / size.tile_height;
    for (int row = window.y / size.tile_height; row <= last_row; ++row)
      for (int col = window.x / size.tile_width; col <= last_col; ++col) {
        const int tile_x = col * size.tile_width, tile_y = row * size.tile_height;
        auto ok = tiles_->read(
            {level, col, row}, bands, type, nullptr,
            [&](std::uint32_t y, const std::byte* samples, const std::uint8_t* valid, std::uint32_t n) {
              const int at_y = tile_y + static_cast<int>(y) - window.y;
              const int first = std::max(tile_x, window.x),
                        end = std::min(tile_x + static_cast<int>(n), window.x + window.width);
              if (at_y < 0 || at_y >= window.height || first >= end) return;
              const auto from = static_cast<std::size_t>(first - tile_x), count = static_cast<std::size_t>(end - first);
              const std::size_t to =
                  static_cast<std::size_t>(at_y) * window.width + static_cast<std::size_t>(first - window.x);
              std::memcpy(texels.samples.data() + to * texel, samples + from * texel, count * texel);
              if (!valid) return;
              if (texels.validity.empty()) texels.validity.assign(texels.samples.size() / texel, 1);
              std::memcpy(texels.validity.data() + to, valid + from, count);
            });
        if (!ok) return fail(ok);
      }
    return texels;
  }

 private:
  const std::shared_ptr<const TiffTiles> tiles_;
};

}  // namespace

Result<std::unique_ptr<Raster>> open_tiff_raster(std::shared_ptr<const ByteSource> source,
                                                 const std::string& gdal_name) {
  auto file = tiff::TiffFile::open(std::move(source));
  if (!file) return fail(file);
  const ByteSource& bytes = (*file)->source();
  const auto& directories = (*file)->directories();
  if (std::any_of(directories.begin(), directories.end(), [](const tiff::Directory& d) { return d.strips; }))
    return fail(Error::Kind::Unsupported, bytes.name() + ": not tiled");
  const bool companions = !bytes.is_remote() && has_companions(bytes.name());
  auto description =
      companions ? fail(Error::Kind::Unsupported, bytes.name() + ": files beside it say more") : describe_tiff(**file);
  if (!description && !gdal_name.empty()) {
    const auto module = raster_module();
    if (!module) return fail(module);
    description = (*module)->describe(gdal_name);
    if (description) description->path = bytes.name();
  }
  if (!description) return fail(description);
  if (!description->georeference) return fail(Error::Kind::Unsupported, bytes.name() + ": no georeference");
  for (const Level& level : description->levels)
    if ((level.tile_width % cell_size && cell_size % level.tile_width) ||
        (level.tile_height % cell_size && cell_size % level.tile_height))
      return fail(Error::Kind::Unsupported, bytes.name() + ": cells and its tiles cut each other");
  auto tiles = TiffTiles::make(std::move(*file), *description);
  if (!tiles) return fail(tiles);
  return std::make_unique<TiffRaster>(std::move(*description), std::move(*tiles));
}

}  // namespace nadir::tile
