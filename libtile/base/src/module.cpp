#include "nadir/base/module.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdlib>

#include "module_folder.h"

namespace nadir {
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

namespace {

Result<void*> entry_of(const Module& module, const std::string& file) {
  void* library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!library)
    return fail(Error::Kind::Unsupported,
                fmt::format("{}: cannot be loaded, so {}: {}", file, module.without, dlerror()));
  if (void* entry = dlsym(library, module.entry.c_str())) return entry;
  return fail(Error::Kind::Unsupported,
              fmt::format("{}: belongs to another version of this program (no {} in it)", file, module.entry));
}

/// Where the dynamic linker looks for what the program needs, its run path first. Asked for, and not left to dlopen by
/// name: that takes the run path of whoever calls it, which under sanitizers is their library.
std::vector<fs::path> linker_folders() {
  void* program = dlopen(nullptr, RTLD_LAZY);
  Dl_serinfo size{};
  if (!program || dlinfo(program, RTLD_DI_SERINFOSIZE, &size) != 0) return {};
  std::vector<std::byte> memory(size.dls_size);
  auto* paths = reinterpret_cast<Dl_serinfo*>(memory.data());
  *paths = size;
  if (dlinfo(program, RTLD_DI_SERINFO, paths) != 0) return {};
  std::vector<fs::path> folders;
  for (unsigned i = 0; i < paths->dls_cnt; ++i) folders.emplace_back((&paths->dls_serpath[0])[i].dls_name);
  return folders;
}

}  // namespace

Result<void*> load_module(const Module& module, std::span<const fs::path> folders) {
  std::vector<std::string> searched;
  for (const fs::path& folder : folders) {
    std::error_code error;
    if (fs::exists(folder / module.name, error)) return entry_of(module, (folder / module.name).string());
    searched.push_back(folder.string());
  }
  return fail(Error::Kind::NotFound,
              fmt::format("{}: {} was not found in {}; either this was built without {}, or NADIR_MODULES has to "
                          "name the folder that holds it",
                          module.without, module.name, fmt::join(searched, ", "), module.option));
}

Result<void*> load_module(const Module& module) {
  auto entry = load_module(module, module_folders());
  if (entry || entry.error().kind != Error::Kind::NotFound) return entry;
  const auto by_linker = load_module(module, linker_folders());
  return by_linker || by_linker.error().kind != Error::Kind::NotFound ? by_linker : entry;
}

}  // namespace nadir
