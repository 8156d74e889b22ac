#include "tile_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <limits>
#include <numbers>
#include <vector>

#include "nadir/gdal/dataset.h"
#include "virtual_source.h"

namespace nadir::mosaic {
namespace fs = std::filesystem;
namespace {

/// Half the side of the Web-Mercator square, metres: pi times the equatorial radius of WGS-84.
constexpr double half_world_m = std::numbers::pi * 6378137.0;
constexpr int deepest_zoom = 30;  // tile numbers still fit 32 bits

struct TileFile {
  int x = 0, y = 0;
  fs::path path;
};

std::optional<int> number(const std::string& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < 0) return std::nullopt;
  return value;
}

bool is_tile(const fs::path& file) {
  const std::string extension = file.extension().string();
  return extension == ".png" || extension == ".jpg" || extension == ".jpeg" || extension == ".webp";
}

/// Tiles of one zoom folder, in the order of their numbers.
std::vector<TileFile> list_tiles(const fs::path& zoom_folder) {
  std::vector<TileFile> tiles;
  std::error_code error;
  for (const auto& column : fs::directory_iterator(zoom_folder, error)) {
    const auto x = number(column.path().filename().string());
    if (!x || !column.is_directory(error)) continue;
    for (const auto& file : fs::directory_iterator(column.path(), error))
      if (const auto y = number(file.path().stem().string()); y && is_tile(file.path()))
        tiles.push_back({*x, *y, file.path()});
  }
  std::sort(tiles.begin(), tiles.end(),
            [](const TileFile& a, const TileFile& b) { return std::pair(a.y, a.x) < std::pair(b.y, b.x); });
  return tiles;
}

/// The deepest zoom with a tile in it.
std::optional<int> find_deepest_zoom(const fs::path& folder) {
  std::vector<int> zooms;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (const auto zoom = number(entry.path().filename().string())) zooms.push_back(*zoom);
  std::sort(zooms.rbegin(), zooms.rend());
  for (const int zoom : zooms)
    if (!list_tiles(folder / std::to_string(zoom)).empty()) return zoom;
  return std::nullopt;
}

/// Pieces for red, green, blue and alpha that one tile gives.
Result<std::array<VirtualSource, 4>> pieces_of(const TileFile& tile, int side, int left, int top) {
  auto dataset = gdal::open_raster(tile.path.string());
  if (!dataset) return fail(dataset);
  GDALDataset& raster = **dataset;
  const int count = raster.GetRasterCount();
  if (raster.GetRasterBand(1)->GetRasterDataType() != GDT_Byte || count > 4)
    return fail(Error::Kind::Unsupported,
                fmt::format("{}: expected a picture of 1 to 4 bands of 8 bits, found {} of type {}", tile.path.string(),
                            count, GDALGetDataTypeName(raster.GetRasterBand(1)->GetRasterDataType())));
  if (raster.GetRasterXSize() != side || raster.GetRasterYSize() != side)
    return fail(Error::Kind::Unsupported,
                fmt::format("{}: expected {} x {} texels as the other tiles have, found {} x {}", tile.path.string(),
                            side, side, raster.GetRasterXSize(), raster.GetRasterYSize()));

  VirtualSource piece{
      fs::absolute(tile.path).string(), "1", "Byte", side, side, (tile.x - left) * side, (tile.y - top) * side, ""};
  std::array<VirtualSource, 4> pieces;
  pieces.fill(piece);
  if (count == 1 && raster.GetRasterBand(1)->GetColorTable()) {
    for (int i = 0; i < 4; ++i)
      pieces[static_cast<std::size_t>(i)].rule = fmt::format("<ColorTableComponent>{}</ColorTableComponent>", i + 1);
    return pieces;
  }
  if (count >= 3)
    for (int i = 0; i < 3; ++i) pieces[static_cast<std::size_t>(i)].band = std::to_string(i + 1);
  if (count % 2 == 0)
    pieces[3].band = std::to_string(count);
  else
    pieces[3].rule = "<ScaleOffset>255</ScaleOffset><ScaleRatio>0</ScaleRatio>";
  return pieces;
}

}  // namespace

bool holds_tiles(const fs::path& folder) { return find_deepest_zoom(folder).has_value(); }

Result<std::string> virtual_raster_of_tiles(const fs::path& folder, std::optional<int> zoom) {
  if (!zoom) zoom = find_deepest_zoom(folder);
  const std::vector<TileFile> tiles = zoom ? list_tiles(folder / std::to_string(*zoom)) : std::vector<TileFile>();
  if (tiles.empty())
    return fail(Error::Kind::NotFound,
                fmt::format("{}: expected a folder of map tiles, {{zoom}}/{{x}}/{{y}}.png, found none{}",
                            folder.string(), zoom ? fmt::format(" at zoom {}", *zoom) : ""));
  if (*zoom > deepest_zoom)
    return fail(Error::Kind::Unsupported,
                fmt::format("{}: zoom {}: tiles are numbered to zoom {}", folder.string(), *zoom, deepest_zoom));

  // The rectangle of tiles around all that are there
  int left = tiles.front().x, right = left;
  for (const TileFile& tile : tiles) {
    left = std::min(left, tile.x);
    right = std::max(right, tile.x);
    const std::int64_t count = std::int64_t{1} << *zoom;
    if (tile.x >= count || tile.y >= count)
      return fail(Error::Kind::Malformed,
                  fmt::format("{}: zoom {} has {} columns and rows only", tile.path.string(), *zoom, count));
  }
  const int top = tiles.front().y, bottom = tiles.back().y;
  auto first = gdal::open_raster(tiles.front().path.string());
  if (!first) return fail(first);
  const int side = (*first)->GetRasterXSize();
  const std::int64_t width = (std::int64_t{right} - left + 1) * side, height = (std::int64_t{bottom} - top + 1) * side;
  if (std::max(width, height) > std::numeric_limits<int>::max())
    return fail(Error::Kind::Unsupported,
                fmt::format("{}: its tiles span {} x {} texels, more than a raster can have; build a part of them",
                            folder.string(), width, height));

  std::array<std::string, 4> bands;
  for (const TileFile& tile : tiles) {
    auto pieces = pieces_of(tile, side, left, top);
    if (!pieces) return fail(pieces);
    for (std::size_t b = 0; b < 4; ++b) bands[b] += (*pieces)[b].xml();
  }

  const double tile_m = 2 * half_world_m / static_cast<double>(std::int64_t{1} << *zoom);
  const double texel_m = tile_m / side;
  std::string xml = fmt::format(
      "<VRTDataset rasterXSize=\"{}\" rasterYSize=\"{}\"><SRS>EPSG:3857</SRS><GeoTransform>{:.17g}, {:.17g}, 0, "
      "{:.17g}, 0, {:.17g}</GeoTransform>\n",
      width, height, left * tile_m - half_world_m, texel_m, half_world_m - top * tile_m, -texel_m);
  static constexpr std::array colors = {"Red", "Green", "Blue", "Alpha"};
  for (std::size_t b = 0; b < 4; ++b)
    xml +=
        fmt::format("<VRTRasterBand dataType=\"Byte\" band=\"{}\"><ColorInterp>{}</ColorInterp>\n{}</VRTRasterBand>\n",
                    b + 1, colors[b], bands[b]);
  return xml + "</VRTDataset>\n";
}

}  // namespace nadir::mosaic
