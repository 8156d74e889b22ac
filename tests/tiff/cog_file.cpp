#include "cog_file.h"

#include <cpl_conv.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <stdexcept>

namespace nadir::tiff::test {
namespace {

using Bytes = std::vector<std::byte>;

template <class T>
void append(Bytes& bytes, T value) {
  const auto* begin = reinterpret_cast<const std::byte*>(&value);
  bytes.insert(bytes.end(), begin, begin + sizeof value);
}

void append_sample(Bytes& bytes, const TileFormat& format, double value) {
  switch (format.bits) {
    case 8:
      return append(bytes, static_cast<std::int8_t>(value));  // 0 to 119 lie alike with and without sign
    case 16:
      return append(bytes, static_cast<std::int16_t>(value));
    case 32:
      return format.number == Number::Float ? append(bytes, static_cast<float>(value))
                                            : append(bytes, static_cast<std::int32_t>(value));
    default:
      return format.number == Number::Float ? append(bytes, value) : append(bytes, static_cast<std::int64_t>(value));
  }
}

Bytes deflated(const Bytes& bytes) {
  Bytes packed(bytes.size() + 1024);
  std::size_t size = 0;
  EXPECT_TRUE(CPLZLibDeflate(bytes.data(), bytes.size(), /*nLevel=*/6, packed.data(), packed.size(), &size));
  packed.resize(size);
  return packed;
}

Bytes packed(const TileFormat& format, Bytes bytes) { return format.codec == Codec::Deflate ? deflated(bytes) : bytes; }

/// Of all bands, or of `plane` where they are separate.
Bytes imagery_tile(const CogShape& shape, std::size_t level, std::uint32_t left, std::uint32_t top,
                   std::uint32_t plane) {
  Bytes bytes;
  for (std::uint32_t y = 0; y < shape.format.tile_height; ++y)
    for (std::uint32_t x = 0; x < shape.format.tile_width; ++x)
      for (std::uint32_t band = plane; band < plane + shape.format.samples_together(); ++band)
        append_sample(bytes, shape.format, expected_sample(shape, level, left + x, top + y, band));
  return packed(shape.format, std::move(bytes));
}

Bytes mask_tile(const CogImage& image, std::size_t level, std::uint32_t left, std::uint32_t top) {
  Bytes bytes(image.mask->tile_bytes());
  for (std::uint32_t y = 0; y < image.mask->tile_height; ++y)
    for (std::uint32_t x = 0; x < image.mask->tile_width; ++x)
      if (expected_valid(level, left + x, top + y))
        bytes[y * image.mask->row_bytes() + x / 8] |= std::byte{static_cast<unsigned char>(0x80 >> x % 8)};
  return packed(*image.mask, std::move(bytes));
}

void write_tile(std::ofstream& file, const Bytes& bytes, std::uint64_t offset) {
  if (offset == 0) return;
  const auto size = static_cast<std::uint32_t>(bytes.size());
  file.seekp(static_cast<std::streamoff>(offset - tile_leader_bytes));
  file.write(reinterpret_cast<const char*>(&size), sizeof size);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  file.write(reinterpret_cast<const char*>(bytes.data() + bytes.size() - tile_trailer_bytes), tile_trailer_bytes);
}

}  // namespace

double expected_sample(const CogShape& shape, std::size_t level, std::uint32_t x, std::uint32_t y, std::uint32_t band) {
  const auto value = (level * 41 + x * 3 + y * 7 + band * 11) % 120;
  return static_cast<double>(value) - (shape.format.number == Number::Unsigned ? 0 : 60);
}

bool expected_valid(std::size_t level, std::uint32_t x, std::uint32_t y) { return (level + x + y * 5) % 3 != 0; }

float expected_loss(std::size_t level, std::size_t tile, std::uint32_t band) {
  return static_cast<float>(level) + static_cast<float>(tile) / 1024 + static_cast<float>(band) / 8;
}

TileFormat tile_format(std::uint32_t side, std::uint32_t samples, std::uint32_t bits, Number number) {
  TileFormat format;
  format.tile_width = format.tile_height = side;
  format.samples = samples;
  format.bits = bits;
  format.number = number;
  return format;
}

CogImage image_of(const CogShape& shape) {
  CogImage image;
  image.format = shape.format;
  image.extra_samples = shape.extra_samples;
  image.levels = shape.levels;
  if (shape.mask) {
    image.mask = tile_format(shape.format.tile_width, 1, 1, Number::Unsigned);
    image.mask->codec = shape.format.codec;
    image.mask->photometric = Photometric::TransparencyMask;
  }
  return image;
}

std::uint64_t tiles_of(const CogImage& image, std::size_t level) {
  const auto along = [](std::uint32_t texels, std::uint32_t tile) { return (texels + tile - 1) / tile; };
  return std::uint64_t{along(image.levels[level].width, image.format.tile_width)} *
         along(image.levels[level].height, image.format.tile_height);
}

CogArrangement write_cog(const std::filesystem::path& path, const CogShape& shape) {
  CogImage image = image_of(shape);
  std::vector<TileSizes> sizes(image.levels.size());
  std::vector<TileLosses> losses(image.levels.size());
  std::vector<std::vector<Bytes>> imagery(image.levels.size()), masks(image.levels.size());
  for (std::size_t level = 0; level < image.levels.size(); ++level) {
    const std::uint32_t side = image.format.tile_width, across = (image.levels[level].width + side - 1) / side;
    const std::size_t of_plane = tiles_of(image, level), planes = shape.format.separate ? shape.format.samples : 1;
    for (std::size_t i = 0; i < of_plane * planes; ++i) {
      const std::size_t tile = i % of_plane;
      const auto plane = static_cast<std::uint32_t>(i / of_plane);
      const auto left = static_cast<std::uint32_t>(tile % across) * side;
      const auto top = static_cast<std::uint32_t>(tile / across) * side;
      const bool empty = shape.empty && shape.empty(level, tile);
      imagery[level].push_back(empty ? Bytes() : imagery_tile(shape, level, left, top, plane));
      sizes[level].imagery.push_back(static_cast<std::uint32_t>(imagery[level].back().size()));
      if (image.mask && plane == 0) {
        masks[level].push_back(empty ? Bytes() : mask_tile(image, level, left, top));
        sizes[level].mask.push_back(static_cast<std::uint32_t>(masks[level].back().size()));
      }
      for (std::uint32_t band = 0; shape.losses && level + 1 < image.levels.size() && band < image.format.samples;
           ++band)
        losses[level].push_back(expected_loss(level, tile, band));
    }
  }

  const CogArrangement arrangement = arrange(image, sizes, losses, shape.spare_bytes);
  image.fields.insert(image.fields.end(), shape.late_fields.begin(), shape.late_fields.end());
  const auto written = header(image, sizes, losses, arrangement);
  if (!written) throw std::runtime_error(written.error().message);
  const auto& header_bytes = *written;
  EXPECT_EQ(header_bytes.size(), arrangement.data_begin);
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(header_bytes.data()), static_cast<std::streamsize>(header_bytes.size()));
  for (std::size_t level = 0; level < image.levels.size(); ++level) {
    for (std::size_t tile = 0; tile < imagery[level].size(); ++tile) {
      write_tile(file, imagery[level][tile], arrangement.imagery[level][tile]);
      if (tile < masks[level].size()) write_tile(file, masks[level][tile], arrangement.mask[level][tile]);
    }
    if (losses[level].empty()) continue;
    file.seekp(static_cast<std::streamoff>(arrangement.losses[level]));
    file.write(reinterpret_cast<const char*>(losses[level].data()),
               static_cast<std::streamsize>(losses[level].size() * sizeof(float)));
  }
  file.close();
  EXPECT_EQ(std::filesystem::file_size(path), arrangement.file_bytes) << "nothing lies beyond, nothing is missing";
  return arrangement;
}

}  // namespace nadir::tiff::test
