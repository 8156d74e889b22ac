#include "nadir/record/image_files.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdlib>
#include <mutex>

#include "image_module.h"
#include "module_folder.h"

namespace nadir::record {
namespace fs = std::filesystem;

std::vector<fs::path> module_folders() {
  std::vector<fs::path> folders;
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (!error) {
    folders.push_back(program.parent_path());
    folders.push_back((program.parent_path() / module_folder).lexically_normal());
  }
  if (const char* named = std::getenv("NADIR_MODULES"); named && *named) folders.emplace_back(named);
  return folders;
}

Result<const ImageFiles*> load_image_files(std::span<const fs::path> folders) {
  std::vector<std::string> searched;
  for (const fs::path& folder : folders) {
    const fs::path module = folder / image_module_name;
    std::error_code error;
    if (!fs::exists(module, error)) {
      searched.push_back(folder.string());
      continue;
    }
    // Never closed: OpenImageIO's threads and tables live until the program ends.
    void* library = dlopen(module.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!library)
      return fail(Error::Kind::Unsupported, fmt::format("{}: cannot be loaded, so no image can be read or written: {}",
                                                        module.string(), dlerror()));
    const auto entry = reinterpret_cast<ImageModuleEntry*>(dlsym(library, image_module_entry));
    if (!entry)
      return fail(Error::Kind::Unsupported, fmt::format("{}: belongs to another version of this program (no {} in it)",
                                                        module.string(), image_module_entry));
    return entry();
  }
  return fail(Error::Kind::NotFound,
              fmt::format("no image can be read or written: {} was not found in {}; either this was built without "
                          "OpenImageIO (NADIR_IMAGES), or NADIR_MODULES has to name the folder that holds it",
                          image_module_name, fmt::join(searched, ", ")));
}

Result<const ImageFiles*> image_files() {
  static std::mutex mutex;  // guards `loaded`; a second caller has nothing to do but wait for the first
  static const ImageFiles* loaded = nullptr;
  std::scoped_lock lock(mutex);
  if (loaded) return loaded;
  const auto files = load_image_files(module_folders());
  if (files) loaded = *files;
  return files;
}

}  // namespace nadir::record
