#pragma once

#include <string>

namespace nadir::mosaic {

/// A file in GDAL's memory, gone with this object.
class MemoryFile {
 public:
  explicit MemoryFile(const std::string& contents);
  ~MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace nadir::mosaic
