#pragma once

#include "nadir/record/image_files.h"

namespace nadir::record {

/// What this library and its module agree on. The number in the name goes up whenever ImageFiles or
/// what it takes changes, so that a module of another version is refused and not called.
inline constexpr const char* image_module_name = "nadir_images.so";
inline constexpr const char* image_module_entry = "nadir_image_files_1";
using ImageModuleEntry = const ImageFiles*();

}  // namespace nadir::record
