#include "nadir/record/image_files.h"

#include "image_module.h"

namespace nadir::record {

Result<const ImageFiles*> load_image_files(std::span<const std::filesystem::path> folders) {
  const auto entry = load_module(image_module(), folders);
  if (!entry) return fail(entry);
  return reinterpret_cast<ImageModuleEntry*>(*entry)();
}

Result<const ImageFiles*> image_files() {
  static LazyModule<ImageFiles> module(image_module());
  return module.get();
}

}  // namespace nadir::record
