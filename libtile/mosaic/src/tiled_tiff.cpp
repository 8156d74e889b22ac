#include <algorithm>
#include <cstring>

#include "block_source.h"
#include "thread_memory.h"
#include "tiff_rows.h"

namespace nadir::mosaic {
namespace {

using tiff::Directory, tiff::TileFormat;

/// The packed bytes of a tile, read into `buffer`; empty where it was never written.
Result<std::span<const std::byte>> packed_tile(const tiff::TiffFile& tiff, const tiff::TileAddress& address,
                                               std::vector<std::byte>& buffer) {
  const auto place = tiff.locate({&address, 1}).front();
  if (!place) return fail(place);
  if (buffer.size() < place->size) buffer.resize(static_cast<std::size_t>(place->size));
  const std::span<std::byte> bytes = std::span(buffer).first(static_cast<std::size_t>(place->size));
  if (auto ok = tiff.source().read(place->offset, bytes); !ok) return fail(ok);
  return bytes;
}

/// Unpacks the rows of a tile that lie in the image; the last strip is not as high as others.
Result<void> unpack(const Directory& directory, std::span<const std::byte> packed, std::uint32_t rows,
                    const tiff::RowSink& sink) {
  if (!directory.strips || rows == directory.format.tile_height)
    return tiff::decode_tile(directory.format, packed, rows, sink);
  TileFormat last = directory.format;
  last.tile_height = rows;
  return tiff::decode_tile(last, packed, rows, sink);
}

const TexelType mask_type{Sample::U8, 1, false, false, std::nullopt};

/// A TIFF whose tiles are decoded here. Its mask may be cut into other tiles.
class TiledTiff : public BlockSource {
 public:
  TiledTiff(const RasterHeader& header, const Reading& reading, std::shared_ptr<Shared> shared)
      : BlockSource(header, reading.rule.to, static_cast<int>(header.tiff->image_directory.format.tile_width),
                    static_cast<int>(header.tiff->image_directory.format.tile_height), shared),
        layout_(*header.tiff),
        rows_(rows_of(header, reading)),
        conversion_(rows_.rule),
        mask_number_(shared->blocks.add_raster()) {}

 protected:
  Result<void> decode(Block& block) const override;

 private:
  Result<void> decode_planes(const tiff::TiffFile& tiff, const Block& block, std::vector<std::byte>& packed,
                             std::byte* together) const;
  Result<void> read_mask(const tiff::TiffFile& tiff, const Window& window, std::uint8_t* mask) const;
  Result<void> decode_mask(const tiff::TiffFile& tiff, std::uint32_t col, std::uint32_t row, Block& block) const;
  tl::unexpected<Error> told(const Window& window, const Error& error) const {
    return error.kind == Error::Kind::Damaged ? damaged(window, error.message) : tl::unexpected<Error>(error);
  }

  const TiffLayout layout_;
  const TiffRows rows_;
  const Conversion conversion_;
  const std::uint32_t mask_number_;  // in the cache
};

Result<void> TiledTiff::decode(Block& block) const {
  static thread_local std::vector<std::byte> packed, together;
  static thread_local std::vector<std::uint8_t> mask;
  const ThreadMemory packed_memory(packed), together_memory(together);
  const ThreadMemory mask_memory(mask);
  const auto tiff = shared_->tiffs.get(file_);
  if (!tiff) return fail(tiff);
  const Window& w = block.window();
  const auto texels = static_cast<std::size_t>(w.width);
  const Directory& image = layout_.image_directory;
  if (layout_.mask) {
    mask.resize(block.texels());
    if (auto ok = read_mask(**tiff, w, mask.data()); !ok) return ok;
  }
  const auto convert = [&](std::uint32_t line, const std::byte* samples) {
    const std::int32_t y = w.y + static_cast<std::int32_t>(line);
    conversion_.row(samples, layout_.mask ? mask.data() + line * texels : nullptr, texels, block.row(y),
                    block.masked() ? block.valid_row(y) : nullptr);
  };

  const std::size_t texel = rows_.missing.size();
  const auto rows = static_cast<std::uint32_t>(w.height);
  if (!image.format.separate) {
    const auto bytes = packed_tile(**tiff,
                                   {layout_.image, 0, static_cast<std::uint32_t>(w.x) / image.format.tile_width,
                                    static_cast<std::uint32_t>(w.y) / image.format.tile_height},
                                   packed);
    if (!bytes) return told(w, bytes.error());
    if (!bytes->empty()) {
      auto ok = unpack(image, *bytes, rows, convert);
      return ok ? ok : told(w, ok.error());
    }
    together.resize(texels * texel);
    for (std::size_t x = 0; x < texels; ++x) std::memcpy(together.data() + x * texel, rows_.missing.data(), texel);
    for (std::uint32_t line = 0; line < rows; ++line) convert(line, together.data());
    return {};
  }
  const std::size_t row_bytes = (texels * texel + 7) / 8 * 8;
  together.resize(row_bytes * rows);
  if (auto ok = decode_planes(**tiff, block, packed, together.data()); !ok) return ok;
  for (std::uint32_t line = 0; line < rows; ++line) convert(line, together.data() + line * row_bytes);
  return {};
}

/// Bands that lie apart are put together.
Result<void> TiledTiff::decode_planes(const tiff::TiffFile& tiff, const Block& block, std::vector<std::byte>& packed,
                                      std::byte* together) const {
  const Window& w = block.window();
  const Directory& image = layout_.image_directory;
  const std::size_t texels = static_cast<std::size_t>(w.width), planes = rows_.planes.size(),
                    row_bytes = (texels * rows_.missing.size() + 7) / 8 * 8;
  const auto rows = static_cast<std::uint32_t>(w.height);
  return tiff::with_sample(rows_.rule.stored, [&]<class T>(T) -> Result<void> {
    for (std::size_t p = 0; p < planes; ++p) {
      const auto into = [&](std::uint32_t line) { return reinterpret_cast<T*>(together + line * row_bytes) + p; };
      const auto bytes =
          packed_tile(tiff,
                      {layout_.image, rows_.planes[p], static_cast<std::uint32_t>(w.x) / image.format.tile_width,
                       static_cast<std::uint32_t>(w.y) / image.format.tile_height},
                      packed);
      if (!bytes) return told(w, bytes.error());
      if (bytes->empty()) {
        T missing;
        std::memcpy(&missing, rows_.missing.data() + p * sizeof(T), sizeof missing);
        for (std::uint32_t line = 0; line < rows; ++line)
          for (std::size_t x = 0; x < texels; ++x) into(line)[x * planes] = missing;
        continue;
      }
      auto ok = unpack(image, *bytes, rows, [&](std::uint32_t line, const std::byte* samples) {
        T* out = into(line);
        for (std::size_t x = 0; x < texels; ++x) out[x * planes] = reinterpret_cast<const T*>(samples)[x];
      });
      if (!ok) return told(w, ok.error());
    }
    return {};
  });
}

Result<void> TiledTiff::read_mask(const tiff::TiffFile& tiff, const Window& window, std::uint8_t* mask) const {
  const Directory& directory = layout_.mask_directory;
  const std::int64_t width = directory.format.tile_width, height = directory.format.tile_height,
                     right = window.x + std::int64_t{window.width}, bottom = window.y + std::int64_t{window.height};
  for (std::int64_t row = window.y / height; row * height < bottom; ++row)
    for (std::int64_t col = window.x / width; col * width < right; ++col) {
      const auto tile_col = static_cast<std::uint32_t>(col), tile_row = static_cast<std::uint32_t>(row);
      const auto block =
          shared_->blocks.get(mask_number_, std::uint64_t{tile_row} * directory.tiles_across() + tile_col,
                              [&](Block& fresh) { return decode_mask(tiff, tile_col, tile_row, fresh); });
      if (!block) return fail(block);
      const Window& b = (*block)->window();
      const std::int32_t x = std::max(window.x, b.x), y = std::max(window.y, b.y);
      const auto texels = static_cast<std::size_t>(std::min<std::int64_t>(right, b.x + b.width) - x);
      for (std::int32_t line = y; line < std::min<std::int64_t>(bottom, b.y + b.height); ++line)
        std::memcpy(mask + static_cast<std::size_t>(line - window.y) * static_cast<std::size_t>(window.width) +
                        static_cast<std::size_t>(x - window.x),
                    (*block)->row(line) + (x - b.x), texels);
    }
  return {};
}

Result<void> TiledTiff::decode_mask(const tiff::TiffFile& tiff, std::uint32_t col, std::uint32_t row,
                                    Block& block) const {
  const Directory& directory = layout_.mask_directory;
  const TileFormat& format = directory.format;
  const std::uint32_t x = col * format.tile_width, y = row * format.tile_height;
  block.reset(mask_type, {static_cast<std::int32_t>(x), static_cast<std::int32_t>(y),
                          static_cast<std::int32_t>(std::min(format.tile_width, directory.width - x)),
                          static_cast<std::int32_t>(std::min(format.tile_height, directory.height - y))});
  static thread_local std::vector<std::byte> packed;
  const ThreadMemory packed_memory(packed);
  const Window& w = block.window();
  const auto texels = static_cast<std::size_t>(w.width);
  const auto bytes = packed_tile(tiff, {*layout_.mask, 0, col, row}, packed);
  if (!bytes) return told(w, bytes.error());
  if (bytes->empty()) {  // nothing is valid where none was written
    std::memset(block.row(w.y), 0, block.texels());
    return {};
  }
  const std::uint8_t half = static_cast<std::uint8_t>(format.bits == 8 ? 128 : 1);
  auto ok =
      unpack(directory, *bytes, static_cast<std::uint32_t>(w.height), [&](std::uint32_t line, const std::byte* data) {
        const auto* values = reinterpret_cast<const std::uint8_t*>(data);
        auto* out = reinterpret_cast<std::uint8_t*>(block.row(w.y + static_cast<std::int32_t>(line)));
        for (std::size_t i = 0; i < texels; ++i) out[i] = values[i] >= half ? 255 : 0;
      });
  return ok ? ok : told(w, ok.error());
}

}  // namespace

std::shared_ptr<const Source> make_tiled_source(const RasterHeader& header, const Reading& reading,
                                                std::shared_ptr<Shared> shared) {
  return std::make_shared<const TiledTiff>(header, reading, std::move(shared));
}

}  // namespace nadir::mosaic
