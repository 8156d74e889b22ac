#pragma once

#include <filesystem>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "nadir/base/result.h"

namespace nadir {

/// A part that is loaded when it is first needed, since what it links costs every start of a program that does not.
struct Module {
  std::string name;     // of its file: "nadir_images.so"
  std::string entry;    // of its one function, with a number that goes up when what it gives changes
  std::string without;  // what cannot be done without it: "no image can be read or written"
  std::string option;   // of the build, that leaves it out, with what that needs: "OpenImageIO (NADIR_IMAGES)"
};

/// Where modules are looked for, in this order: beside the running program, where they are installed seen from there,
/// and the folder that the environment variable NADIR_MODULES names.
std::vector<std::filesystem::path> module_folders();

/// The module's function, from the first of `folders` that has the file.
/// Never closed: what a module starts lives until the program ends.
/// NotFound without the file, Unsupported where it belongs to another version or does not load.
Result<void*> load_module(const Module& module, std::span<const std::filesystem::path> folders);

/// The same from `module_folders()`, else from where the dynamic linker finds it: along the run path of a program that
/// embeds this library.
Result<void*> load_module(const Module& module);

/// What a module's function gives, loaded at the first call; after a failure the next call tries again.
/// Thread-safe.
template <class Table>
class LazyModule {
 public:
  explicit LazyModule(Module module) : module_(std::move(module)) {}
  Result<const Table*> get() {
    const std::scoped_lock lock(mutex_);
    if (table_) return table_;
    const auto entry = load_module(module_);
    if (!entry) return fail(entry);
    table_ = reinterpret_cast<const Table* (*)()>(*entry)();
    return table_;
  }

 private:
  const Module module_;
  std::mutex mutex_;  // guards table_; a second caller has nothing to do but wait for the first
  const Table* table_ = nullptr;
};

}  // namespace nadir
