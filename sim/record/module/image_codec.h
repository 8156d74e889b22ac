#pragma once

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <filesystem>
#include <memory>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/record/image.h"

namespace nadir::record {

OIIO::TypeDesc oiio_type(tile::SampleType type);

/// An encoder of images like `image`, in the format that the extension of `path` names, writing to `file`.
Result<std::unique_ptr<OIIO::ImageOutput>> open_output(const std::filesystem::path& path, const ImageView& image,
                                                       OIIO::Filesystem::IOProxy& file);

/// The bytes of `image` as a file in the format that the extension of `path` names; nothing is written.
Result<std::vector<unsigned char>> encode(const std::filesystem::path& path, const ImageView& image);

/// See ImageFiles::read.
Result<Image> decode(const std::filesystem::path& path);

}  // namespace nadir::record
