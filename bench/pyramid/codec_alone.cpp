#include "codec_alone.h"

#include <cpl_error.h>
#include <fmt/format.h>
#include <gdal.h>
#include <libdeflate.h>
#include <zstd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <thread>

#include <jpeglib.h>  // after cstdio, which it forgets

namespace nadir::bench {
namespace {

constexpr std::size_t row_bytes = std::size_t{build_tile_side} * 3;
constexpr std::size_t tile_bytes = row_bytes * build_tile_side;
constexpr std::size_t most_in_pool = 256;

/// The library of a thread. 0 bytes: it failed.
class Library {
 public:
  virtual ~Library() = default;
  virtual std::size_t pack(const std::vector<unsigned char>& tile) = 0;
};

class Copy : public Library {
 public:
  std::size_t pack(const std::vector<unsigned char>& tile) override {
    std::memcpy(out_.data(), tile.data(), tile.size());
    return tile.size();
  }

 private:
  std::vector<unsigned char> out_ = std::vector<unsigned char>(tile_bytes);
};

class Deflate : public Library {
 public:
  explicit Deflate(int level) : library_(libdeflate_alloc_compressor(level)) {
    out_.resize(libdeflate_zlib_compress_bound(library_.get(), tile_bytes));
  }
  std::size_t pack(const std::vector<unsigned char>& tile) override {
    return libdeflate_zlib_compress(library_.get(), tile.data(), tile.size(), out_.data(), out_.size());
  }

 private:
  struct Free {
    void operator()(libdeflate_compressor* c) const { libdeflate_free_compressor(c); }
  };
  std::unique_ptr<libdeflate_compressor, Free> library_;
  std::vector<unsigned char> out_;
};

class Zstd : public Library {
 public:
  explicit Zstd(int level) : level_(level), library_(ZSTD_createCCtx()), out_(ZSTD_compressBound(tile_bytes)) {}
  std::size_t pack(const std::vector<unsigned char>& tile) override {
    const std::size_t size =
        ZSTD_compressCCtx(library_.get(), out_.data(), out_.size(), tile.data(), tile.size(), level_);
    return ZSTD_isError(size) ? 0 : size;
  }

 private:
  struct Free {
    void operator()(ZSTD_CCtx* c) const { ZSTD_freeCCtx(c); }
  };
  int level_;
  std::unique_ptr<ZSTD_CCtx, Free> library_;
  std::vector<unsigned char> out_;
};

class Jpeg : public Library {
 public:
  explicit Jpeg(bool half_chroma) : half_chroma_(half_chroma), out_(2 * tile_bytes) {
    library_.err = jpeg_std_error(&handler_);
    jpeg_create_compress(&library_);
  }
  ~Jpeg() override { jpeg_destroy_compress(&library_); }
  std::size_t pack(const std::vector<unsigned char>& tile) override {
    unsigned char* to = out_.data();
    unsigned long size = out_.size();
    jpeg_mem_dest(&library_, &to, &size);
    library_.image_width = library_.image_height = build_tile_side;
    library_.input_components = 3;
    library_.in_color_space = JCS_RGB;
    jpeg_set_defaults(&library_);
    jpeg_set_quality(&library_, 90, TRUE);
    library_.comp_info[0].h_samp_factor = library_.comp_info[0].v_samp_factor = half_chroma_ ? 2 : 1;
    jpeg_suppress_tables(&library_, TRUE);  // tiles of a TIFF share theirs
    jpeg_start_compress(&library_, FALSE);
    while (library_.next_scanline < library_.image_height) {
      auto* row = const_cast<JSAMPROW>(tile.data() + library_.next_scanline * row_bytes);
      jpeg_write_scanlines(&library_, &row, 1);
    }
    jpeg_finish_compress(&library_);
    return to == out_.data() ? size : 0;
  }

 private:
  bool half_chroma_;
  jpeg_compress_struct library_{};
  jpeg_error_mgr handler_{};
  std::vector<unsigned char> out_;
};

std::unique_ptr<Library> library_for(const BuildPacking& packing) {
  switch (packing.codec) {
    case BuildCodec::none:
      break;
    case BuildCodec::jpeg:
      return std::make_unique<Jpeg>(packing.half_chroma);
    case BuildCodec::deflate:
      return std::make_unique<Deflate>(packing.level);
    case BuildCodec::zstd:
      return std::make_unique<Zstd>(packing.level);
  }
  return std::make_unique<Copy>();
}

/// The means of squares of `step` x `step` texels.
std::vector<unsigned char> reduced(const std::vector<unsigned char>& from, int step) {
  std::vector<unsigned char> to(tile_bytes);
  const std::size_t n = static_cast<std::size_t>(step), from_row = row_bytes * n;
  for (std::size_t y = 0; y < build_tile_side; ++y)
    for (std::size_t x = 0; x < build_tile_side; ++x)
      for (std::size_t c = 0; c < 3; ++c) {
        std::size_t sum = 0;
        for (std::size_t j = 0; j < n; ++j)
          for (std::size_t i = 0; i < n; ++i) sum += from[(y * n + j) * from_row + (x * n + i) * 3 + c];
        to[y * row_bytes + 3 * x + c] = static_cast<unsigned char>((sum + n * n / 2) / (n * n));
      }
  return to;
}

/// Differences along rows, in place.
void predict(std::vector<unsigned char>& tile) {
  for (std::size_t y = 0; y < build_tile_side; ++y)
    for (std::size_t i = row_bytes; i-- > 3;)
      tile[y * row_bytes + i] = static_cast<unsigned char>(tile[y * row_bytes + i] - tile[y * row_bytes + i - 3]);
}

std::size_t tiles_of_pyramid(int side) {
  std::size_t tiles = 0;
  for (;; side = (side + 1) / 2) {
    const auto across = static_cast<std::size_t>((side + build_tile_side - 1) / build_tile_side);
    tiles += across * across;
    if (across == 1) return tiles;
  }
}

}  // namespace

Result<std::shared_ptr<CodecAlone>> CodecAlone::make(const std::string& source, const BuildPacking& packing) {
  struct Close {
    void operator()(GDALDatasetH dataset) const { GDALClose(dataset); }
  };
  GDALAllRegister();
  const std::unique_ptr<void, Close> dataset(GDALOpen(source.c_str(), GA_ReadOnly));
  if (!dataset) return fail(Error::Kind::Io, fmt::format("{}: {}", source, CPLGetLastErrorMsg()));
  const int side = GDALGetRasterXSize(dataset.get());
  const std::size_t tiles = tiles_of_pyramid(side);
  std::shared_ptr<CodecAlone> alone(new CodecAlone(packing, tiles));
  const std::size_t in_pool = std::min(tiles, most_in_pool);
  for (std::size_t i = 0; i < in_pool; ++i) {
    const int step = i % 16 == 15 ? 4 : i % 4 == 3 ? 2 : 1;
    // Places by the golden ratio along one axis and in order along the other: spread evenly
    const int wide = std::min(step * build_tile_side, side);
    const double across = 0.6180339887498949 * static_cast<double>(i);
    const int x = static_cast<int>((side - wide) * (across - std::floor(across)));
    const int y = static_cast<int>((side - wide) * (static_cast<double>(i) / static_cast<double>(in_pool)));
    const int take = build_tile_side * step;
    Bytes texels(tile_bytes * static_cast<std::size_t>(step * step));
    if (GDALDatasetRasterIO(dataset.get(), GF_Read, x, y, wide, wide, texels.data(), take, take, GDT_Byte, 3, nullptr,
                            3, 3 * take, 1) != CE_None)
      return fail(Error::Kind::Io, fmt::format("{}: {}", source, CPLGetLastErrorMsg()));
    Bytes tile = step == 1 ? std::move(texels) : reduced(texels, step);
    if (packing.codec == BuildCodec::deflate || packing.codec == BuildCodec::zstd) predict(tile);
    alone->pool_.push_back(std::move(tile));
  }
  return alone;
}

Result<void> CodecAlone::run() {
  std::atomic<std::size_t> next = 0, bytes = 0;
  std::atomic<bool> failed = false;
  {
    std::vector<std::jthread> workers;
    for (int t = 0; t < build_threads; ++t)
      workers.emplace_back([&] {
        const auto library = library_for(packing_);
        for (std::size_t i = next++; i < tiles_; i = next++) {
          const std::size_t size = library->pack(pool_[i % pool_.size()]);
          if (size == 0) failed = true;
          bytes += size;
        }
      });
  }
  packed_bytes_ = bytes;
  if (failed) return fail(Error::Kind::Io, packing_.name() + ": its library failed");
  return {};
}

}  // namespace nadir::bench
