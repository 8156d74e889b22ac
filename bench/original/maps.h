#pragma once

#include <filesystem>

#include "nadir/geodesy/geodetic.h"
#include "nadir/tile/map.h"

namespace nadir::bench {

/// Middle of the map of the paper's experiment, its size, and its texel: a Google tile of zoom 17, in Mercator metres.
inline constexpr geodesy::Degrees paper_lat{35.309003}, paper_lon{-80.741692};
inline constexpr int paper_width = 6400, paper_height = 6150;
inline constexpr double paper_texel_m = 1.194328567;

/// One of the maps that the repository ships: "kampala.tif".
tile::Map shipped_map(const std::string& name);

/// kampala.tif without its alpha band, which the original does not know, and with levels made anew from level 0 and
/// stored without loss: all methods see the same texels, and errors are those of sampling.
tile::Map kampala_without_loss(const std::filesystem::path& folder);

/// Black, three bands, at the paper's place and texel size, with four white squares `mark_texels` from the middle, to
/// the east, north, west and south.
inline constexpr int mark_texels = 150;
tile::Map map_with_marks(const std::filesystem::path& folder);

/// naip_2014.tif taken into EPSG:3857.
tile::Map naip_in_mercator(const std::filesystem::path& folder);

/// naip_2014.tif enlarged to the paper's size and put at the paper's place, with levels: the scene is not of that
/// place, the amount of data is.
std::filesystem::path paper_sized_map(const std::filesystem::path& folder);

}  // namespace nadir::bench
