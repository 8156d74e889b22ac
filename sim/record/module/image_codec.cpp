#include "image_codec.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cctype>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>

namespace nadir::record {
namespace fs = std::filesystem;
namespace {

using tile::SampleType;

enum class Format { Png, Tiff };

std::optional<Format> format_of(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  if (extension == ".png") return Format::Png;
  if (extension == ".tif" || extension == ".tiff") return Format::Tiff;
  return std::nullopt;
}

SampleType sample_type(OIIO::TypeDesc type) {
  if (type == OIIO::TypeDesc::UINT8) return SampleType::UInt8;
  if (type == OIIO::TypeDesc::INT16) return SampleType::Int16;
  if (type == OIIO::TypeDesc::UINT16) return SampleType::UInt16;
  return SampleType::Float32;
}

/// Whether a PNG file has all of its chunks. Where it ends early, libpng would tell so on standard error and
/// OpenImageIO 2.4.7 lose a string, as libpng jumps over its destructor.
bool has_all_chunks(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  file.seekg(8);  // past the signature
  std::array<unsigned char, 8> head;
  while (file.read(reinterpret_cast<char*>(head.data()), head.size())) {
    const auto length = std::streamoff{head[0]} << 24 | head[1] << 16 | head[2] << 8 | head[3];
    constexpr std::streamoff checksum_bytes = 4;
    if (std::string_view(reinterpret_cast<const char*>(&head[4]), 4) == "IEND") return true;
    file.seekg(length + checksum_bytes, std::ios::cur);
  }
  return false;
}

/// Whether `format` can hold `image`, and why not.
Result<void> check_holds(Format format, const fs::path& path, const ImageView& image) {
  constexpr int tiff_channels = 65535;  // SamplesPerPixel is a 16-bit number
  const bool holds = format == Format::Png
                         ? image.channels <= 4 && (image.type == SampleType::UInt8 || image.type == SampleType::UInt16)
                         : image.channels <= tiff_channels;
  if (holds) return {};
  return fail(
      Error::Kind::Unsupported,
      fmt::format("{}: cannot hold {} with {} channels: {}", path.string(), tile::to_string(image.type), image.channels,
                  format == Format::Png ? "PNG takes uint8 and uint16 with 1 to 4 channels; TIFF takes all types"
                                        : "TIFF takes at most 65535"));
}

OIIO::ImageSpec spec_of(Format format, const ImageView& image) {
  OIIO::ImageSpec spec(image.width, image.height, image.channels, oiio_type(image.type));
  // Channels are data. By default the fourth is alpha, and the others are divided by it.
  spec.alpha_channel = -1;
  spec.attribute("oiio:UnassociatedAlpha", 1);
  if (format == Format::Png) {
    // Of the 30 settings of record_bench the fastest small one that also packs flat areas (README.md).
    constexpr int average_filter = 64;  // libpng's PNG_FILTER_AVG
    spec.attribute("compression", "rle");
    spec.attribute("png:compressionLevel", 1);
    spec.attribute("png:filter", average_filter);
  } else {
    spec.attribute("compression", "zip");
    spec.attribute("tiff:zipquality", 1);
    spec.attribute("DateTime", 0);  // not a text, so not written; left out, the time of writing would be
  }
  return spec;
}

}  // namespace

OIIO::TypeDesc oiio_type(SampleType type) {
  switch (type) {
    case SampleType::Int16:
      return OIIO::TypeDesc::INT16;
    case SampleType::UInt16:
      return OIIO::TypeDesc::UINT16;
    case SampleType::Float32:
      return OIIO::TypeDesc::FLOAT;
    case SampleType::UInt8:
      break;
  }
  return OIIO::TypeDesc::UINT8;
}

Result<std::unique_ptr<OIIO::ImageOutput>> open_output(const fs::path& path, const ImageView& image,
                                                       OIIO::Filesystem::IOProxy& file) {
  assert(image.width > 0 && image.height > 0 && image.channels > 0);
  const auto format = format_of(path);
  if (!format)
    return fail(Error::Kind::Unsupported, fmt::format("{}: images are written as .png, .tif or .tiff", path.string()));
  if (const auto holds = check_holds(*format, path, image); !holds) return fail(holds);
  const std::string name = *format == Format::Png ? "memory.png" : "memory.tif";
  auto output = OIIO::ImageOutput::create(name, &file);
  if (!output || !output->open(name, spec_of(*format, image)))
    return fail(Error::Kind::Io,
                fmt::format("{}: encoding failed: {}", path.string(), output ? output->geterror() : OIIO::geterror()));
  return output;
}

Result<std::vector<unsigned char>> encode(const fs::path& path, const ImageView& image) {
  assert(image.samples);
  // Encode into memory: a full disk is then seen by our own writing, which knows the cause and cleans up.
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  const auto output = open_output(path, image, memory);
  if (!output) return fail(output);
  if (!(*output)->write_image(oiio_type(image.type), image.samples) || !(*output)->close())
    return fail(Error::Kind::Io, fmt::format("{}: encoding failed: {}", path.string(), (*output)->geterror()));
  return bytes;
}

Result<Image> decode(const fs::path& path) {
  const auto format = format_of(path);
  if (!format)
    return fail(Error::Kind::Unsupported, fmt::format("{}: images are read from .png, .tif or .tiff", path.string()));
  std::error_code error;
  if (!fs::is_regular_file(path, error))
    return fail(Error::Kind::NotFound, fmt::format("{}: no such file", path.string()));
  const std::uintmax_t file_bytes = fs::file_size(path, error);

  if (format == Format::Png && !has_all_chunks(path))
    return fail(Error::Kind::Malformed,
                fmt::format("{}: expected a PNG image, found no end to it in {} bytes", path.string(), file_bytes));
  OIIO::ImageSpec wishes;
  wishes.attribute("oiio:UnassociatedAlpha", 1);
  const auto input = OIIO::ImageInput::open(path.string(), &wishes);
  if (!input)
    return fail(Error::Kind::Malformed,
                fmt::format("{}: expected a PNG or TIFF image: {}", path.string(), OIIO::geterror()));

  // Do not allocate what only a header claims: deflate makes at most 1032 bytes of one, and small images are harmless.
  const OIIO::ImageSpec& spec = input->spec();
  constexpr std::uintmax_t harmless_bytes = 64 << 20;
  Image image{{}, sample_type(spec.format), spec.width, spec.height, spec.nchannels};
  const std::size_t bytes = image.view().size_bytes();
  if (bytes > std::max(harmless_bytes, file_bytes * 1032))
    return fail(Error::Kind::Malformed,
                fmt::format("{}: claims {}x{} pixels of {} channels in a file of {} bytes", path.string(), spec.width,
                            spec.height, spec.nchannels, file_bytes));
  image.samples.resize(bytes);
  if (!input->read_image(0, 0, 0, spec.nchannels, oiio_type(image.type), image.samples.data()))
    return fail(Error::Kind::Malformed, fmt::format("{}: reading failed: {}", path.string(), input->geterror()));
  return image;
}

}  // namespace nadir::record
