#pragma once

#include "nadir/base/module.h"
#include "nadir/record/image_files.h"

namespace nadir::record {

using ImageModuleEntry = const ImageFiles*();

/// What this library and its module agree on. The number in the entry's name goes up whenever ImageFiles or what it
/// takes changes, so that a module of another version is refused and not called.
inline Module image_module() {
  return {"nadir_images.so", "nadir_image_files_2", "no image can be read or written", "OpenImageIO (NADIR_IMAGES)"};
}

}  // namespace nadir::record
