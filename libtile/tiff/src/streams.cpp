// Codecs of byte streams, each by its own library.
#include <fmt/format.h>
#include <libdeflate.h>
#include <lzma.h>
#include <zstd.h>

#include <memory>

#include "codecs.h"

namespace nadir::tiff {

Result<std::size_t> unpack_deflate_some(std::span<const std::byte> packed, std::span<std::byte> out) {
  struct Free {
    void operator()(libdeflate_decompressor* d) const { libdeflate_free_decompressor(d); }
  };
  thread_local const std::unique_ptr<libdeflate_decompressor, Free> decompressor(libdeflate_alloc_decompressor());
  std::size_t got = 0;
  const auto status =
      libdeflate_zlib_decompress(decompressor.get(), packed.data(), packed.size(), out.data(), out.size(), &got);
  if (status == LIBDEFLATE_INSUFFICIENT_SPACE) return damaged("DEFLATE data hold more than a tile");
  if (status != LIBDEFLATE_SUCCESS) return damaged("DEFLATE data are damaged");
  return got;
}

Result<std::size_t> unpack_zstd_some(std::span<const std::byte> packed, std::span<std::byte> out) {
  struct Free {
    void operator()(ZSTD_DCtx* d) const { ZSTD_freeDCtx(d); }
  };
  thread_local const std::unique_ptr<ZSTD_DCtx, Free> context(ZSTD_createDCtx());
  const std::size_t got = ZSTD_decompressDCtx(context.get(), out.data(), out.size(), packed.data(), packed.size());
  if (ZSTD_isError(got)) return damaged(fmt::format("Zstandard data are damaged: {}", ZSTD_getErrorName(got)));
  return got;
}

Result<void> unpack_deflate(std::span<const std::byte> packed, std::span<std::byte> out) {
  const auto got = unpack_deflate_some(packed, out);
  if (!got) return fail(got);
  if (*got != out.size()) return damaged(fmt::format("DEFLATE data hold {} bytes of {}", *got, out.size()));
  return {};
}

Result<void> unpack_zstd(std::span<const std::byte> packed, std::span<std::byte> out) {
  const auto got = unpack_zstd_some(packed, out);
  if (!got) return fail(got);
  if (*got != out.size()) return damaged(fmt::format("Zstandard data hold {} bytes of {}", *got, out.size()));
  return {};
}

Result<void> unpack_lzma(std::span<const std::byte> packed, std::span<std::byte> out) {
  std::uint64_t memory_limit = 256 << 20;  // a dictionary for the largest preset takes 65 MiB
  std::size_t read = 0, written = 0;
  const lzma_ret status =
      lzma_stream_buffer_decode(&memory_limit, 0, nullptr, reinterpret_cast<const std::uint8_t*>(packed.data()), &read,
                                packed.size(), reinterpret_cast<std::uint8_t*>(out.data()), &written, out.size());
  if (status != LZMA_OK) return damaged(fmt::format("LZMA data are damaged (code {})", static_cast<int>(status)));
  if (written != out.size()) return damaged(fmt::format("LZMA data hold {} bytes of {}", written, out.size()));
  return {};
}

}  // namespace nadir::tiff
