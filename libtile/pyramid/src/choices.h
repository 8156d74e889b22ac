#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nadir/mosaic/mosaic.h"
#include "nadir/pyramid/build.h"
#include "nadir/tiff/encode.h"
#include "reduction.h"

namespace nadir::pyramid {

/// What follows from options and sources together: each with its reason in the code.

/// The role asked for, else the one that all sources state.
std::optional<tile::Role> choose_role(const BuildOptions& options, const mosaic::Sources& sources);

Result<Reduction> choose_reduction(const BuildOptions& options, std::optional<tile::Role> role,
                                   const mosaic::Sources& sources, std::vector<std::string>& warnings);
std::string describe(const Reduction& reduction);  // "box of power"

/// Whether samples come back changed.
bool is_lossy(const BuildOptions& options);
std::string_view name_of(mosaic::Sample sample);  // "uint8"

/// Error::Unsupported where options contradict each other or the role.
Result<void> check_options(const BuildOptions& options);

/// How tiles are packed. Errors begin with the first source's name.
struct TileCodec {
  tiff::TileFormat imagery;
  std::vector<std::uint16_t> extra_samples;
  std::optional<tiff::TileFormat> mask;
  tiff::Packing packing;
};
Result<TileCodec> choose_codec(const BuildOptions& options, std::optional<tile::Role> role,
                               const mosaic::Sources& sources, const mosaic::TexelType& type);

/// Levels a stage: as many as keep a chunk small enough for a cache and for memory, and leave enough of them for all
/// cores.
int choose_depth(const mosaic::Mosaic& mosaic, int tile_size);

}  // namespace nadir::pyramid
