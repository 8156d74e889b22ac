// Byte streams packed, each codec by its own library.
#include <fmt/format.h>
#include <libdeflate.h>
#include <lzma.h>
#include <zstd.h>

#include <array>
#include <memory>

#include "codecs.h"

namespace nadir::tiff {
namespace {

tl::unexpected<Error> failed(std::string what) { return fail(Error::Kind::Io, std::move(what)); }

}  // namespace

Result<void> pack_deflate(std::span<const std::byte> tile, int level, RawBytes& out) {
  struct Free {
    void operator()(libdeflate_compressor* c) const { libdeflate_free_compressor(c); }
  };
  thread_local std::array<std::unique_ptr<libdeflate_compressor, Free>, 13> compressors;
  auto& compressor = compressors[static_cast<std::size_t>(level)];
  if (!compressor) compressor.reset(libdeflate_alloc_compressor(level));
  const std::size_t begin = out.size();
  out.resize(begin + libdeflate_zlib_compress_bound(compressor.get(), tile.size()));
  const std::size_t size =
      libdeflate_zlib_compress(compressor.get(), tile.data(), tile.size(), out.data() + begin, out.size() - begin);
  if (size == 0) return failed("DEFLATE cannot pack a tile");
  out.resize(begin + size);
  return {};
}

Result<void> pack_zstd(std::span<const std::byte> tile, int level, RawBytes& out) {
  struct Free {
    void operator()(ZSTD_CCtx* c) const { ZSTD_freeCCtx(c); }
  };
  thread_local const std::unique_ptr<ZSTD_CCtx, Free> context(ZSTD_createCCtx());
  const std::size_t begin = out.size();
  out.resize(begin + ZSTD_compressBound(tile.size()));
  const std::size_t size =
      ZSTD_compressCCtx(context.get(), out.data() + begin, out.size() - begin, tile.data(), tile.size(), level);
  if (ZSTD_isError(size)) return failed(fmt::format("Zstandard cannot pack a tile: {}", ZSTD_getErrorName(size)));
  out.resize(begin + size);
  return {};
}

Result<void> pack_lzma(std::span<const std::byte> tile, int level, RawBytes& out) {
  std::size_t size = out.size();
  out.resize(size + lzma_stream_buffer_bound(tile.size()));
  const lzma_ret status = lzma_easy_buffer_encode(static_cast<std::uint32_t>(level), LZMA_CHECK_NONE, nullptr,
                                                  reinterpret_cast<const std::uint8_t*>(tile.data()), tile.size(),
                                                  reinterpret_cast<std::uint8_t*>(out.data()), &size, out.size());
  if (status != LZMA_OK) return failed(fmt::format("LZMA cannot pack a tile (code {})", static_cast<int>(status)));
  out.resize(size);
  return {};
}

}  // namespace nadir::tiff
