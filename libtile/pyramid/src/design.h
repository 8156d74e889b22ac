#pragma once

#include <optional>
#include <string>
#include <vector>

#include "choices.h"
#include "nadir/mosaic/mosaic.h"
#include "nadir/tiff/cog.h"
#include "tile_packer.h"

namespace nadir::pyramid {

/// What is to be made, decided from the sources' headers before anything is written.
struct Design {
  mosaic::Mosaic mosaic;
  std::optional<tile::Role> role;
  Reduction reduction;
  TileCodec codec;
  std::vector<std::string> warnings;
};

Result<Design> design(const BuildOptions& options);

Result<TilePacker> make_packer(const Design& design, const BuildOptions& options);

/// The file that `design` comes to: all but its tiles. `statistics`: of the data bands, once they are known.
Result<tiff::CogImage> describe_file(const Design& design, const BuildOptions& options, const TilePacker& packer,
                                     const std::vector<LevelSize>& levels,
                                     const std::vector<BandStatistics>* statistics);

}  // namespace nadir::pyramid
