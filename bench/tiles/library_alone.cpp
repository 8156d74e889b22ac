#include "library_alone.h"

#include <Lerc_c_api.h>
#include <fmt/format.h>
#include <libdeflate.h>
#include <lzma.h>
#include <tiffio.h>
#include <webp/decode.h>
#include <zstd.h>

#include <cstdio>
#include <cstring>
#include <mutex>

#include <jpeglib.h>  // after cstdio, which it forgets

#include "nadir/tiff/tiff_file.h"

namespace nadir::bench {
namespace {

using tiff::Codec, tiff::TileFormat;

Result<void> wrong(const char* what) { return fail(Error::Kind::Damaged, fmt::format("{} failed", what)); }

Result<void> unpack_jpeg(const TileFormat& format, std::span<const std::byte> packed, std::byte* out) {
  jpeg_decompress_struct decoder{};
  jpeg_error_mgr handler{};
  decoder.err = jpeg_std_error(&handler);
  jpeg_create_decompress(&decoder);
  const auto source = [&](std::span<const std::byte> bytes) {
    jpeg_mem_src(&decoder, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  };
  if (!format.jpeg_tables.empty()) {
    source(format.jpeg_tables);
    jpeg_read_header(&decoder, FALSE);
  }
  source(packed);
  jpeg_read_header(&decoder, TRUE);
  decoder.jpeg_color_space = JCS_YCbCr;
  decoder.out_color_space = JCS_RGB;
  jpeg_start_decompress(&decoder);
  while (decoder.output_scanline < decoder.output_height) {
    auto row = reinterpret_cast<JSAMPROW>(out + decoder.output_scanline * std::size_t{format.tile_width} * 3);
    jpeg_read_scanlines(&decoder, &row, 1);
  }
  jpeg_finish_decompress(&decoder);
  jpeg_destroy_decompress(&decoder);
  return {};
}

class Alone : public LibraryAlone {
 public:
  Alone(TileFormat format, std::vector<std::vector<std::byte>> tiles) : format_(std::move(format)) {
    tiles_ = std::move(tiles);
    tile_bytes_ = static_cast<std::size_t>(format_.tile_bytes());
  }

  Result<void> unpack(std::size_t i, std::byte* out) const override {
    const std::span<const std::byte> packed = tiles_[i];
    switch (format_.codec) {
      case Codec::None:
        std::memcpy(out, packed.data(), tile_bytes_);
        return {};
      case Codec::Deflate: {
        thread_local libdeflate_decompressor* const library = libdeflate_alloc_decompressor();
        return libdeflate_zlib_decompress(library, packed.data(), packed.size(), out, tile_bytes_, nullptr) == 0
                   ? Result<void>{}
                   : wrong("libdeflate");
      }
      case Codec::Zstd: {
        thread_local ZSTD_DCtx* const library = ZSTD_createDCtx();
        return ZSTD_decompressDCtx(library, out, tile_bytes_, packed.data(), packed.size()) == tile_bytes_
                   ? Result<void>{}
                   : wrong("libzstd");
      }
      case Codec::Lzma: {
        std::uint64_t limit = 1 << 30;
        std::size_t read = 0, written = 0;
        return lzma_stream_buffer_decode(&limit, 0, nullptr, reinterpret_cast<const std::uint8_t*>(packed.data()),
                                         &read, packed.size(), reinterpret_cast<std::uint8_t*>(out), &written,
                                         tile_bytes_) == LZMA_OK
                   ? Result<void>{}
                   : wrong("liblzma");
      }
      case Codec::WebP:
        return WebPDecodeRGBInto(reinterpret_cast<const std::uint8_t*>(packed.data()), packed.size(),
                                 reinterpret_cast<std::uint8_t*>(out), tile_bytes_,
                                 static_cast<int>(format_.tile_width * 3))
                   ? Result<void>{}
                   : wrong("libwebp");
      case Codec::Lerc:
        return lerc_decode(reinterpret_cast<const unsigned char*>(packed.data()), static_cast<unsigned>(packed.size()),
                           0, nullptr, static_cast<int>(format_.samples), static_cast<int>(format_.tile_width),
                           static_cast<int>(format_.tile_height), 1, 1, out) == 0
                   ? Result<void>{}
                   : wrong("liblerc");
      case Codec::Jpeg:
        return unpack_jpeg(format_, packed, out);
      case Codec::Lzw:
        break;
    }
    return wrong("no library");
  }

 private:
  const TileFormat format_;
};

/// libtiff over a file: a handle for each thread that asks.
class ByLibtiff : public LibraryAlone {
 public:
  ByLibtiff(std::string path, std::size_t tiles, std::size_t tile_bytes) : path_(std::move(path)) {
    tiles_.resize(tiles);
    tile_bytes_ = tile_bytes;
  }
  ~ByLibtiff() override {
    for (TIFF* handle : handles_) TIFFClose(handle);
  }
  Result<void> unpack(std::size_t i, std::byte* out) const override {
    TIFF* handle = nullptr;
    {
      const std::scoped_lock lock(mutex_);
      if (!handles_.empty()) handle = handles_.back(), handles_.pop_back();
    }
    if (!handle) handle = TIFFOpen(path_.c_str(), "r");
    if (!handle) return wrong("libtiff");
    const auto got =
        TIFFReadEncodedTile(handle, static_cast<std::uint32_t>(i), out, static_cast<tmsize_t>(tile_bytes_));
    const std::scoped_lock lock(mutex_);
    handles_.push_back(handle);
    return got == static_cast<tmsize_t>(tile_bytes_) ? Result<void>{} : wrong("libtiff");
  }

 private:
  const std::string path_;
  mutable std::mutex mutex_;
  mutable std::vector<TIFF*> handles_;
};

}  // namespace

Result<std::unique_ptr<LibraryAlone>> LibraryAlone::open(const std::filesystem::path& path) {
  auto source = LocalFile::open(path.string());
  if (!source) return fail(source);
  const auto file = tiff::TiffFile::open(std::move(*source));
  if (!file) return fail(file);
  const tiff::Directory& directory = (*file)->directories().front();
  if (directory.format.codec == Codec::Lzw) {
    TIFFSetWarningHandler(nullptr);
    return std::make_unique<ByLibtiff>(path.string(), directory.tiles_a_plane(),
                                       static_cast<std::size_t>(directory.format.tile_bytes()));
  }
  std::vector<std::vector<std::byte>> tiles;
  for (std::uint32_t row = 0; row < directory.tiles_down(); ++row)
    for (std::uint32_t col = 0; col < directory.tiles_across(); ++col) {
      const tiff::TileAddress tile{0, 0, col, row};
      const auto place = (*file)->locate({&tile, 1}).front();
      if (!place) return fail(place);
      tiles.emplace_back(static_cast<std::size_t>(place->size));
      if (auto ok = (*file)->source().read(place->offset, tiles.back()); !ok) return fail(ok);
    }
  return std::make_unique<Alone>(directory.format, std::move(tiles));
}

}  // namespace nadir::bench
