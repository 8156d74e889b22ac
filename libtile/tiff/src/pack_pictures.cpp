// Pictures packed, each codec by its own library.
#include <Lerc_c_api.h>
#include <fmt/format.h>
#include <webp/encode.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <memory>

#include <jpeglib.h>  // after cstdio, which it forgets

#include "codecs.h"

namespace nadir::tiff {
namespace {

constexpr int lerc_version = 4;  // of the codec, that readers of TIFFs know

tl::unexpected<Error> failed(std::string what) { return fail(Error::Kind::Io, std::move(what)); }

/// A compressor, its output and the way out of it: libjpeg reports by calling back, and leaves by longjmp.
class JpegEncoder {
 public:
  JpegEncoder() {
    encoder_.err = jpeg_std_error(&handler_);
    handler_.error_exit = [](j_common_ptr info) {
      auto* self = static_cast<JpegEncoder*>(info->client_data);
      info->err->format_message(info, self->message_.data());
      std::longjmp(self->way_out_, 1);
    };
    handler_.output_message = [](j_common_ptr) {};
    jpeg_create_compress(&encoder_);
    encoder_.client_data = this;
    destination_.init_destination = [](j_compress_ptr info) {
      auto* self = static_cast<JpegEncoder*>(info->client_data);
      const std::size_t begin = self->out_->size();
      self->out_->resize(begin + (1 << 18));
      self->point_at(begin);
    };
    destination_.empty_output_buffer = [](j_compress_ptr info) -> boolean {
      auto* self = static_cast<JpegEncoder*>(info->client_data);
      const std::size_t full = self->out_->size();
      self->out_->resize(full + (1 << 18));
      self->point_at(full);
      return TRUE;
    };
    destination_.term_destination = [](j_compress_ptr info) {
      auto* self = static_cast<JpegEncoder*>(info->client_data);
      self->out_->resize(self->out_->size() - self->destination_.free_in_buffer);
    };
    encoder_.dest = &destination_;
  }
  ~JpegEncoder() { jpeg_destroy_compress(&encoder_); }
  JpegEncoder(const JpegEncoder&) = delete;
  JpegEncoder& operator=(const JpegEncoder&) = delete;

  /// Null where all went well. Holds nothing that a longjmp would leak.
  const char* write_tables(const TileFormat& format, int quality, RawBytes& out) {
    if (setjmp(way_out_)) return message_.data();
    set_up(format, quality, out);
    jpeg_suppress_tables(&encoder_, FALSE);
    jpeg_write_tables(&encoder_);
    return nullptr;
  }

  const char* write_tile(const TileFormat& format, int quality, const std::byte* rows, std::size_t stride,
                         RawBytes& out) {
    if (setjmp(way_out_)) {
      jpeg_abort_compress(&encoder_);
      return message_.data();
    }
    set_up(format, quality, out);
    jpeg_suppress_tables(&encoder_, TRUE);
    jpeg_start_compress(&encoder_, FALSE);
    while (encoder_.next_scanline < encoder_.image_height) {
      std::array<JSAMPROW, 16> some{};
      const std::uint32_t n = std::min<std::uint32_t>(some.size(), encoder_.image_height - encoder_.next_scanline);
      for (std::uint32_t i = 0; i < n; ++i)
        some[i] = reinterpret_cast<JSAMPROW>(const_cast<std::byte*>(rows + (encoder_.next_scanline + i) * stride));
      jpeg_write_scanlines(&encoder_, some.data(), n);
    }
    jpeg_finish_compress(&encoder_);
    return nullptr;
  }

 private:
  void set_up(const TileFormat& format, int quality, RawBytes& out) {
    out_ = &out;
    encoder_.image_width = format.tile_width;
    encoder_.image_height = format.tile_height;
    encoder_.input_components = static_cast<int>(format.samples);
    encoder_.in_color_space = format.samples == 3 ? JCS_RGB : JCS_GRAYSCALE;
    jpeg_set_defaults(&encoder_);
    jpeg_set_colorspace(&encoder_, format.samples == 3 ? JCS_YCbCr : JCS_GRAYSCALE);
    jpeg_set_quality(&encoder_, quality, TRUE);
    encoder_.comp_info[0].h_samp_factor = encoder_.comp_info[0].v_samp_factor = format.chroma_step;
    encoder_.write_JFIF_header = FALSE;
    encoder_.write_Adobe_marker = FALSE;
  }

  void point_at(std::size_t at) {
    destination_.next_output_byte = reinterpret_cast<JOCTET*>(out_->data() + at);
    destination_.free_in_buffer = out_->size() - at;
  }

  jpeg_compress_struct encoder_{};
  jpeg_error_mgr handler_{};
  jpeg_destination_mgr destination_{};
  RawBytes* out_ = nullptr;
  std::jmp_buf way_out_;
  std::array<char, JMSG_LENGTH_MAX> message_{};
};

JpegEncoder& jpeg_of_this_thread() {
  thread_local const std::unique_ptr<JpegEncoder> jpeg = std::make_unique<JpegEncoder>();
  return *jpeg;
}

/// 1 where no sample is missing. False where only some of a texel's samples are.
template <class T>
bool mark_valid(std::span<const std::byte> tile, std::size_t samples, std::vector<unsigned char>& valid) {
  const auto* from = reinterpret_cast<const T*>(tile.data());
  bool all_alike = true;
  for (unsigned char& texel : valid) {
    const auto missing = std::count_if(from, from + samples, [](T v) { return std::isnan(v); });
    texel = missing == 0;
    all_alike &= missing == 0 || missing == static_cast<std::ptrdiff_t>(samples);
    from += samples;
  }
  return all_alike;
}

}  // namespace

Result<std::vector<std::byte>> make_jpeg_tables(const TileFormat& format, int quality) {
  RawBytes tables;
  if (const char* problem = jpeg_of_this_thread().write_tables(format, quality, tables))
    return failed(fmt::format("JPEG cannot make its tables: {}", problem));
  return std::vector<std::byte>(tables.begin(), tables.end());
}

Result<void> pack_jpeg(const TileFormat& format, int quality, const std::byte* rows, std::size_t stride,
                       RawBytes& out) {
  if (const char* problem = jpeg_of_this_thread().write_tile(format, quality, rows, stride, out))
    return failed(fmt::format("JPEG cannot pack a tile: {}", problem));
  return {};
}

Result<void> pack_webp(const TileFormat& format, int quality, const std::byte* rows, std::size_t stride,
                       RawBytes& out) {
  WebPConfig config;
  WebPPicture picture;
  if (!WebPConfigInit(&config) || !WebPPictureInit(&picture)) return failed("WebP is of another version");
  struct Free {
    WebPPicture& picture;
    ~Free() { WebPPictureFree(&picture); }
  } free{picture};
  config.quality = static_cast<float>(quality);
  if (quality == 100) {
    config.lossless = 1;
    config.exact = 1;  // colours under full transparency too
    config.quality = 75;
  }
  picture.use_argb = config.lossless;
  picture.width = static_cast<int>(format.tile_width);
  picture.height = static_cast<int>(format.tile_height);
  picture.writer = [](const std::uint8_t* data, std::size_t size, const WebPPicture* p) {
    auto& bytes = *static_cast<RawBytes*>(p->custom_ptr);
    const auto* begin = reinterpret_cast<const std::byte*>(data);
    bytes.insert(bytes.end(), begin, begin + size);
    return 1;
  };
  picture.custom_ptr = &out;
  const auto* from = reinterpret_cast<const std::uint8_t*>(rows);
  const int step = static_cast<int>(stride);
  const int taken =
      format.samples == 4 ? WebPPictureImportRGBA(&picture, from, step) : WebPPictureImportRGB(&picture, from, step);
  if (!taken || !WebPEncode(&config, &picture))
    return failed(fmt::format("WebP cannot pack a tile (code {})", static_cast<int>(picture.error_code)));
  return {};
}

Result<void> pack_lerc(const TileFormat& format, double max_error, std::span<const std::byte> tile, RawBytes& out) {
  const std::size_t area = std::size_t{format.tile_width} * format.tile_height, samples = format.samples;
  static thread_local std::vector<unsigned char> valid;
  bool masked = false;
  if (format.number == Number::Float) {
    valid.resize(area);
    const bool alike =
        format.bits == 32 ? mark_valid<float>(tile, samples, valid) : mark_valid<double>(tile, samples, valid);
    if (!alike)
      return fail(Error::Kind::Unsupported,
                  "LERC cannot hold a texel of which some bands are NaN; choose --compress zstd");
    masked = std::find(valid.begin(), valid.end(), 0) != valid.end();
  }
  const int columns = static_cast<int>(format.tile_width), rows = static_cast<int>(format.tile_height);
  const auto* mask = masked ? valid.data() : nullptr;
  unsigned size = 0, written = 0;
  if (lerc_computeCompressedSizeForVersion(tile.data(), lerc_version, lerc_type(format), static_cast<int>(samples),
                                           columns, rows, 1, masked ? 1 : 0, mask, max_error, &size) != 0)
    return failed("LERC cannot pack a tile");
  const std::size_t begin = out.size();
  out.resize(begin + size);
  if (lerc_encodeForVersion(tile.data(), lerc_version, lerc_type(format), static_cast<int>(samples), columns, rows, 1,
                            masked ? 1 : 0, mask, max_error, reinterpret_cast<unsigned char*>(out.data() + begin), size,
                            &written) != 0)
    return failed("LERC cannot pack a tile");
  out.resize(begin + written);
  return {};
}

}  // namespace nadir::tiff
