#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "nadir/tiff/decode.h"
#include "nadir/tiff/tiff_file.h"
#include "nadir/tile/map.h"

namespace nadir::tile {

/// The type in which decoded samples are held by maps; empty for signed bytes, which are not rendered.
std::optional<SampleType> held_as(tiff::Sample sample);

/// Address of a stored tile of a map.
struct TileKey {
  int level = 0;
  std::int32_t col = 0, row = 0;
};

/// What is packed of one tile: of each plane that a reader wants, and of the mask.
struct PackedTile {
  std::vector<std::vector<std::byte>> planes;  // empty where the tile was never written
  std::vector<std::byte> mask;
};

/// Takes row `y` of a tile, from its top: `texels` of them, bands interleaved; `valid` is null where mask and alpha say
/// nothing, else 1 or 0 for each.
using TexelRowSink =
    std::function<void(std::uint32_t y, const std::byte* samples, const std::uint8_t* valid, std::uint32_t texels)>;

/// A map's levels as the directories of a TIFF, and their tiles as rows of texels.
/// Thread-safe.
class TiffTiles {
 public:
  /// Unsupported where the file does not hold what the description tells (its levels, mask or bands lie in other files,
  /// or it was packed in a way that is not read here).
  static Result<std::shared_ptr<const TiffTiles>> make(std::shared_ptr<const tiff::TiffFile> file,
                                                       const MapDescription& description);

  /// Packed bytes of several tiles, read together: for a file that is far away. Each with its own error.
  std::vector<Result<PackedTile>> fetch(std::span<const TileKey> tiles, std::span<const int> bands) const;

  /// Decodes the texels of a tile that lie in the level, `bands` (numbers from 1) of them as samples of `type`.
  /// `packed`: what `fetch` brought; null where it is to be read now. Damaged where it is no such tile.
  Result<void> read(const TileKey& tile, std::span<const int> bands, SampleType type, const PackedTile* packed,
                    const TexelRowSink& sink) const;

  /// See Map::loss.
  std::optional<double> loss(int level, const Window& window, std::span<const int> bands) const;

  bool is_remote() const { return file_->source().is_remote(); }

 private:
  struct LevelDirectories {
    std::uint32_t image = 0;
    std::optional<std::uint32_t> mask;
  };
  TiffTiles(std::shared_ptr<const tiff::TiffFile> file, const MapDescription& description);
  const tiff::Directory& image(int level) const;
  std::vector<std::uint32_t> planes_of(std::span<const int> bands) const;
  Result<std::span<const std::byte>> packed_plane(const tiff::TileAddress& tile, std::vector<std::byte>& buffer) const;
  Error damage(const TileKey& tile, const std::string& cause) const;

  const std::shared_ptr<const tiff::TiffFile> file_;
  const std::string path_;
  std::vector<LevelDirectories> levels_;
  /// Where the losses of a level's tiles lie in the file.
  struct LossTable {
    std::uint64_t offset = 0;
    std::uint32_t bands = 0;  // of each tile
  };
  std::optional<LossTable> loss_table(int level) const;
  std::vector<std::optional<LossTable>> loss_tables_;  // of each level

  std::optional<int> alpha_;  // band, from 1
  double missing_ = 0;        // what a tile that was never written holds
};

}  // namespace nadir::tile
