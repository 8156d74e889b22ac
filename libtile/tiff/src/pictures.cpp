// Codecs of pictures, each by its own library.
#include <Lerc_c_api.h>
#include <fmt/format.h>
#include <webp/decode.h>

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>
#include <vector>

#include <jpeglib.h>  // after cstdio, which it forgets

#include "codecs.h"

namespace nadir::tiff {
namespace {

/// A decompressor and the way out of it: libjpeg reports by calling back, and leaves by longjmp.
struct JpegDecoder {
  JpegDecoder() {
    decoder.err = jpeg_std_error(&handler);
    handler.error_exit = [](j_common_ptr info) { leave(info); };
    // It goes on with grey after a warning: to a map, a picture that was made up.
    handler.emit_message = [](j_common_ptr info, int level) {
      if (level < 0) leave(info);
    };
    handler.output_message = [](j_common_ptr) {};
    jpeg_create_decompress(&decoder);
    decoder.client_data = this;
    // A progressive picture may ask for its coefficients once more for each of any number of scans.
    monitor.progress_monitor = [](j_common_ptr info) {
      auto* self = reinterpret_cast<j_decompress_ptr>(info);
      if (self->input_scan_number > 100) leave(info);
    };
    decoder.progress = &monitor;
  }
  ~JpegDecoder() { jpeg_destroy_decompress(&decoder); }
  JpegDecoder(const JpegDecoder&) = delete;
  JpegDecoder& operator=(const JpegDecoder&) = delete;

  [[noreturn]] static void leave(j_common_ptr info) {
    auto* self = static_cast<JpegDecoder*>(info->client_data);
    info->err->format_message(info, self->message.data());
    std::longjmp(self->way_out, 1);
  }

  jpeg_decompress_struct decoder{};
  jpeg_error_mgr handler{};
  jpeg_progress_mgr monitor{};
  std::jmp_buf way_out;
  std::array<char, JMSG_LENGTH_MAX> message{};
};

/// Decodes with `jpeg`; null where all went well. Holds nothing that a longjmp would leak.
const char* decode_jpeg(JpegDecoder& jpeg, const TileFormat& format, std::span<const std::byte> packed,
                        std::byte* out) {
  jpeg_decompress_struct& decoder = jpeg.decoder;
  if (setjmp(jpeg.way_out)) {
    jpeg_abort_decompress(&decoder);
    return jpeg.message.data();
  }
  const auto bytes = [](std::span<const std::byte> b) { return reinterpret_cast<const unsigned char*>(b.data()); };
  if (!format.jpeg_tables.empty()) {
    jpeg_mem_src(&decoder, bytes(format.jpeg_tables), format.jpeg_tables.size());
    if (jpeg_read_header(&decoder, FALSE) != JPEG_HEADER_TABLES_ONLY) {
      jpeg_abort_decompress(&decoder);
      return "its shared tables are a picture";
    }
  }
  jpeg_mem_src(&decoder, bytes(packed), packed.size());
  jpeg_read_header(&decoder, TRUE);
  if (decoder.image_width != format.tile_width || decoder.image_height != format.tile_height ||
      decoder.num_components != static_cast<int>(format.samples_together()) || decoder.data_precision != 8) {
    jpeg_abort_decompress(&decoder);
    return "it is a picture of another size";
  }
  // The TIFF says what its components are, whatever markers say.
  if (format.photometric == Photometric::YCbCr && !format.separate) {
    decoder.jpeg_color_space = JCS_YCbCr;
    decoder.out_color_space = JCS_RGB;
  } else {
    decoder.jpeg_color_space = decoder.out_color_space = JCS_UNKNOWN;
  }
  jpeg_start_decompress(&decoder);
  const std::size_t row_bytes = std::size_t{format.tile_width} * format.samples_together();
  while (decoder.output_scanline < decoder.output_height) {
    std::array<JSAMPROW, 8> rows{};
    const std::uint32_t n = std::min<std::uint32_t>(8, decoder.output_height - decoder.output_scanline);
    for (std::uint32_t i = 0; i < n; ++i)
      rows[i] = reinterpret_cast<JSAMPROW>(out + (decoder.output_scanline + i) * row_bytes);
    jpeg_read_scanlines(&decoder, rows.data(), n);
  }
  jpeg_finish_decompress(&decoder);
  return nullptr;
}

template <class T>
void mark_missing(const std::vector<unsigned char>& valid, std::size_t samples, std::byte* out) {
  auto* to = reinterpret_cast<T*>(out);
  for (std::size_t i = 0; i < valid.size(); ++i)
    if (!valid[i]) std::fill_n(to + i * samples, samples, std::numeric_limits<T>::quiet_NaN());
}

}  // namespace

unsigned lerc_type(const TileFormat& format) {
  if (format.number == Number::Float) return format.bits == 32 ? 6 : 7;
  const unsigned width = format.bits == 8 ? 0 : format.bits == 16 ? 2 : 4;
  return width + (format.number == Number::Signed ? 0 : 1);
}

Result<void> unpack_jpeg(const TileFormat& format, std::span<const std::byte> packed, std::span<std::byte> out) {
  thread_local std::unique_ptr<JpegDecoder> jpeg;
  if (!jpeg) jpeg = std::make_unique<JpegDecoder>();
  if (const char* problem = decode_jpeg(*jpeg, format, packed, out.data())) {
    const std::string words = problem;
    jpeg.reset();  // whatever state it was left in
    return damaged(fmt::format("JPEG data are damaged: {}", words));
  }
  return {};
}

Result<void> unpack_webp(const TileFormat& format, std::span<const std::byte> packed, std::span<std::byte> out) {
  const auto* data = reinterpret_cast<const std::uint8_t*>(packed.data());
  int width = 0, height = 0;
  if (!WebPGetInfo(data, packed.size(), &width, &height)) return damaged("WebP data are damaged");
  if (width != static_cast<int>(format.tile_width) || height != static_cast<int>(format.tile_height))
    return damaged(fmt::format("a WebP picture of {} x {}", width, height));
  const int row_bytes = static_cast<int>(format.tile_width * format.samples);
  auto* to = reinterpret_cast<std::uint8_t*>(out.data());
  const std::uint8_t* done = format.samples == 4 ? WebPDecodeRGBAInto(data, packed.size(), to, out.size(), row_bytes)
                                                 : WebPDecodeRGBInto(data, packed.size(), to, out.size(), row_bytes);
  if (!done) return damaged("WebP data are damaged");
  return {};
}

Result<void> unpack_lerc(const TileFormat& format, std::span<const std::byte> packed, std::span<std::byte> out) {
  const auto* blob = reinterpret_cast<const unsigned char*>(packed.data());
  const auto blob_bytes = static_cast<unsigned int>(packed.size());
  std::array<unsigned int, 10> info{};
  std::array<double, 3> range{};
  if (lerc_getBlobInfo(blob, blob_bytes, info.data(), range.data(), static_cast<int>(info.size()),
                       static_cast<int>(range.size())) != 0)
    return damaged("LERC data are damaged");
  const unsigned type = info[1], depth = info[2], columns = info[3], rows = info[4], bands = info[5], valid = info[6];
  const unsigned samples = format.samples_together();
  if (type != lerc_type(format) || columns != format.tile_width || rows != format.tile_height ||
      std::uint64_t{depth} * bands != samples || (depth != samples && samples > 1))
    return damaged(fmt::format("LERC data of {} x {} x {} samples of type {}", columns, rows, depth * bands, type));
  const std::size_t area = std::size_t{columns} * rows;
  const bool masked = valid < area;
  std::vector<unsigned char> mask(masked ? area : 0);
  if (lerc_decode(blob, blob_bytes, masked ? 1 : 0, masked ? mask.data() : nullptr, static_cast<int>(depth),
                  static_cast<int>(columns), static_cast<int>(rows), static_cast<int>(bands), type, out.data()) != 0)
    return damaged("LERC data are damaged");
  if (masked) {  // what the writer masked was NaN
    if (format.number != Number::Float) return damaged("LERC data with a mask of their own over integers");
    format.bits == 32 ? mark_missing<float>(mask, samples, out.data())
                      : mark_missing<double>(mask, samples, out.data());
  }
  return {};
}

}  // namespace nadir::tiff
