#include "scratch.h"

#include <cpl_vsi.h>
#include <fmt/format.h>

#include <atomic>

#include "nadir/base/files.h"

namespace nadir::pyramid {
namespace fs = std::filesystem;

Result<Scratch> Scratch::beside(const fs::path& output) {
  const fs::path folder = temporary_name(fs::absolute(output));
  std::error_code error;
  fs::create_directories(folder, error);
  if (error)
    return fail(Error::Kind::Io, fmt::format("{}: cannot write beside it: {}", output.string(), error.message()));
  return Scratch(output, folder);
}

Scratch::~Scratch() {
  std::error_code ignored;
  if (!folder_.empty()) fs::remove_all(folder_, ignored);
}

MemoryFile::MemoryFile(const std::string& contents) {
  static std::atomic<unsigned> counter{0};
  path_ = fmt::format("/vsimem/nadir-pyramid-{}.vrt", counter++);
  VSILFILE* file = VSIFOpenL(path_.c_str(), "wb");
  VSIFWriteL(contents.data(), 1, contents.size(), file);
  VSIFCloseL(file);
}

MemoryFile::~MemoryFile() { VSIUnlink(path_.c_str()); }

}  // namespace nadir::pyramid
