#pragma once

#include <filesystem>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/record/image.h"

namespace nadir::record {

/// The bytes of `image` as a file in the format that the extension of `path` names; nothing is written.
Result<std::vector<unsigned char>> encode(const std::filesystem::path& path, const ImageView& image);

/// See ImageFiles::read.
Result<Image> decode(const std::filesystem::path& path);

}  // namespace nadir::record
