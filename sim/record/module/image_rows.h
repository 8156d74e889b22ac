#pragma once

#include <memory>

#include "nadir/record/image_files.h"

namespace nadir::record {

/// See ImageFiles::begin.
Result<std::unique_ptr<ImageRows>> begin_rows(const std::filesystem::path& path, const ImageView& shape);

}  // namespace nadir::record
