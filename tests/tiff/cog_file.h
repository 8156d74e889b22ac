#pragma once

#include <filesystem>
#include <functional>

#include "nadir/tiff/cog.h"

namespace nadir::tiff::test {

/// What a file of a test is like. Texels follow from where they are, so that a misplaced tile shows.
struct CogShape {
  TileFormat format;
  std::vector<CogLevel> levels;
  std::vector<std::uint16_t> extra_samples = {};
  bool mask = false;
  bool losses = false;
  std::function<bool(std::size_t level, std::size_t tile)> empty = {};  // whether a tile is left out; none where unset
  std::uint64_t spare_bytes = 0;
  std::vector<NewField> late_fields = {};  // that become known after tiles were laid out
};

/// The sample at a place of a level, within 0 and 119, or -60 and 59 where numbers may be negative.
double expected_sample(const CogShape& shape, std::size_t level, std::uint32_t x, std::uint32_t y, std::uint32_t band);

/// Whether the mask calls a texel valid.
bool expected_valid(std::size_t level, std::uint32_t x, std::uint32_t y);

/// The loss of a tile and band in shapes that have losses.
float expected_loss(std::size_t level, std::size_t tile, std::uint32_t band);

/// A format of interleaved samples in tiles of `side` texels.
TileFormat tile_format(std::uint32_t side, std::uint32_t samples, std::uint32_t bits, Number number);

/// The image of `shape`, without the fields that come late.
CogImage image_of(const CogShape& shape);

/// Tiles of each level down and across, of one band where they are separate.
std::uint64_t tiles_of(const CogImage& image, std::size_t level);

/// Writes the file: tiles packed here as they are or by GDAL's zlib, as the format says; leaders and trailers around
/// them.
CogArrangement write_cog(const std::filesystem::path& path, const CogShape& shape);

}  // namespace nadir::tiff::test
