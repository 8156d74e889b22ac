#include "memory_file.h"

#include <cpl_vsi.h>
#include <fmt/format.h>

#include <atomic>

namespace nadir::mosaic {

MemoryFile::MemoryFile(const std::string& contents) {
  static std::atomic<unsigned> counter{0};
  path_ = fmt::format("/vsimem/nadir-mosaic-{}.vrt", counter++);
  VSILFILE* file = VSIFOpenL(path_.c_str(), "wb");
  VSIFWriteL(contents.data(), 1, contents.size(), file);
  VSIFCloseL(file);
}

MemoryFile::~MemoryFile() { VSIUnlink(path_.c_str()); }

}  // namespace nadir::mosaic
