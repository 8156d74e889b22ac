#include "nadir/record/truth_plane_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <string>
#include <variant>

#include "nadir/base/byte_source.h"
#include "nadir/base/files.h"
#include "nadir/tiff/cog.h"
#include "nadir/tiff/decode.h"
#include "nadir/tiff/tiff_file.h"

namespace nadir::record {
namespace fs = std::filesystem;
namespace {

using render::TruthPlanes;

struct Band {
  const char *name, *unit;
  std::variant<std::vector<double> TruthPlanes::*, std::vector<float> TruthPlanes::*> plane;
};
constexpr std::array<Band, 6> bands = {{{"longitude_deg", "deg", &TruthPlanes::longitude_deg},
                                        {"latitude_deg", "deg", &TruthPlanes::latitude_deg},
                                        {"height_ellipsoid_m", "m", &TruthPlanes::height_m},
                                        {"range_m", "m", &TruthPlanes::range_m},
                                        {"incidence_deg", "deg", &TruthPlanes::incidence_deg},
                                        {"ground_sample_distance_m", "m", &TruthPlanes::ground_sample_distance_m}}};
constexpr std::uint32_t tile_side = 256;

tiff::TileFormat tile_format() {
  tiff::TileFormat format;
  format.tile_width = format.tile_height = tile_side;
  format.samples = bands.size();
  format.bits = 64;
  format.number = tiff::Number::Float;
  format.separate = true;  // half as large as interleaved, and a band is read alone
  format.codec = tiff::Codec::Deflate;
  format.predictor = tiff::Predictor::FloatingPoint;
  return format;
}

/// Names and units of bands, as GDAL writes them.
std::string metadata() {
  std::string text = "<GDALMetadata>\n";
  for (std::size_t i = 0; i < bands.size(); ++i)
    text += fmt::format(
        "  <Item name=\"DESCRIPTION\" sample=\"{0}\" role=\"description\">{1}</Item>\n"
        "  <Item name=\"UNITTYPE\" sample=\"{0}\" role=\"unittype\">{2}</Item>\n",
        i, bands[i].name, bands[i].unit);
  return text + "</GDALMetadata>\n";
}

tiff::NewField text_field(std::uint16_t tag, const std::string& text) {
  constexpr std::uint16_t ascii = 2;
  const auto bytes = std::as_bytes(std::span(text.c_str(), text.size() + 1));
  return {tag, ascii, bytes.size(), {bytes.begin(), bytes.end()}};
}

tiff::CogImage image_of(const TruthPlanes& planes) {
  tiff::CogImage image;
  image.format = tile_format();
  image.extra_samples.assign(bands.size() - 1, 0);  // that mean something unspecified, not alpha
  image.levels = {{static_cast<std::uint32_t>(planes.width), static_cast<std::uint32_t>(planes.height)}};
  image.fields = {text_field(tiff::tag::gdal_metadata, metadata()), text_field(tiff::tag::gdal_nodata, "nan")};
  return image;
}

/// What a tile holds: pixels of one band, the first of them at `first` in its plane.
struct Tile {
  std::size_t band, first;
  std::uint32_t col, row, width, height;
};

/// In the order of the file.
std::vector<Tile> tiles_of(std::uint32_t width, std::uint32_t height) {
  std::vector<Tile> tiles;
  for (std::size_t band = 0; band < bands.size(); ++band)
    for (std::uint32_t top = 0; top < height; top += tile_side)
      for (std::uint32_t left = 0; left < width; left += tile_side)
        tiles.push_back({band, std::size_t{top} * width + left, left / tile_side, top / tile_side,
                         std::min(tile_side, width - left), std::min(tile_side, height - top)});
  return tiles;
}

/// The tile's values, NaN where it goes beyond the image.
std::vector<double> values_of(const TruthPlanes& planes, const Tile& tile) {
  std::vector<double> values(std::size_t{tile_side} * tile_side, std::numeric_limits<double>::quiet_NaN());
  std::visit(
      [&](auto plane) {
        for (std::size_t y = 0; y < tile.height; ++y)
          std::copy_n((planes.*plane).begin() +
                          static_cast<std::ptrdiff_t>(tile.first + y * static_cast<std::size_t>(planes.width)),
                      tile.width, values.begin() + static_cast<std::ptrdiff_t>(y * tile_side));
      },
      bands[tile.band].plane);
  return values;
}

void put_row(const std::byte* row, const Tile& tile, std::uint32_t y, TruthPlanes& planes) {
  const std::size_t first = tile.first + y * static_cast<std::size_t>(planes.width);
  std::visit(
      [&](auto plane) {
        auto& values = planes.*plane;
        for (std::size_t x = 0; x < tile.width; ++x) {
          double value;
          std::memcpy(&value, row + x * sizeof value, sizeof value);
          values[first + x] = static_cast<std::remove_reference_t<decltype(values[0])>>(value);
        }
      },
      bands[tile.band].plane);
}

/// Whether a file's first image is of our making.
bool is_ours(const tiff::TiffFile& file) {
  const tiff::Directory& directory = file.directories().front();
  const tiff::Field* names = directory.field(tiff::tag::gdal_metadata);
  if (!names) return false;
  const auto text = file.text(*names);
  const tiff::TileFormat &found = directory.format, ours = tile_format();
  return text && *text == metadata() && found.tile_width == ours.tile_width && found.tile_height == ours.tile_height &&
         found.samples == ours.samples && found.separate && found.bits == ours.bits && found.number == ours.number;
}

}  // namespace

Result<void> write_truth_planes(const fs::path& path, const TruthPlanes& planes) {
  const tiff::CogImage image = image_of(planes);
  const auto encoder = tiff::TileEncoder::create(image.format, {});
  if (!encoder) return fail(encoder);
  RawBytes packed;
  std::vector<tiff::TileSizes> sizes(1);
  for (const Tile& tile : tiles_of(image.levels[0].width, image.levels[0].height)) {
    const std::vector<double> values = values_of(planes, tile);
    const auto size = tiff::append_tile(*encoder, std::as_bytes(std::span(values)).data(),
                                        static_cast<std::size_t>(image.format.row_bytes()), packed);
    if (!size) return fail(size);
    sizes[0].imagery.push_back(*size);
  }

  const std::vector<tiff::TileLosses> losses(1);
  const tiff::CogArrangement arrangement = tiff::arrange(image, sizes, losses, /*spare_bytes=*/0);
  const auto header = tiff::header(image, sizes, losses, arrangement);
  if (!header) return fail(header);
  std::string bytes;
  bytes.reserve(arrangement.file_bytes);
  bytes.append(reinterpret_cast<const char*>(header->data()), header->size());
  bytes.append(reinterpret_cast<const char*>(packed.data()), packed.size());
  bytes.resize(arrangement.file_bytes);  // which is a multiple of four
  return write_file(path, bytes);
}

Result<TruthPlanes> read_truth_planes(const fs::path& path) {
  const auto source = LocalFile::open(path.string());
  if (!source) return fail(source);
  const auto file = tiff::TiffFile::open(*source);
  if (!file) return fail(file);
  if (!is_ours(**file))
    return fail(Error::Kind::Malformed, fmt::format("{}: is not a file of truth planes", path.string()));

  const tiff::Directory& directory = (*file)->directories().front();
  // Do not allocate what only a header claims: deflate makes at most 1032 bytes of one
  const std::uint64_t pixels = std::uint64_t{directory.width} * directory.height;
  if (pixels > (*source)->size() * 1032 / (bands.size() * sizeof(double)))
    return fail(Error::Kind::Malformed, fmt::format("{}: claims {}x{} pixels in a file of {} bytes", path.string(),
                                                    directory.width, directory.height, (*source)->size()));
  TruthPlanes planes(static_cast<int>(directory.width), static_cast<int>(directory.height));
  std::vector<std::byte> packed;
  for (const Tile& tile : tiles_of(directory.width, directory.height)) {
    const auto damaged = [&](const Error& error) {
      return fail(error.kind, fmt::format("{}: {}, tile ({}, {}): {}", path.string(), bands[tile.band].name, tile.col,
                                          tile.row, error.message));
    };
    const tiff::TileAddress address{0, static_cast<std::uint32_t>(tile.band), tile.col, tile.row};
    const auto place = (*file)->locate({&address, 1}).front();
    if (!place) return damaged(place.error());
    packed.resize(place->size);
    if (auto ok = (*source)->read(place->offset, packed); !ok) return fail(ok);
    const auto decoded =
        tiff::decode_tile(directory.format, packed, tile.height,
                          [&](std::uint32_t y, const std::byte* row) { put_row(row, tile, y, planes); });
    if (!decoded) return damaged(decoded.error());
  }
  return planes;
}

}  // namespace nadir::record
