#pragma once

#include <filesystem>
#include <string>
#include <utility>

#include "nadir/base/result.h"

namespace nadir::pyramid {

/// A folder for the temporary files of one build, on the disk of its output; it goes with this object.
class Scratch {
 public:
  static Result<Scratch> beside(const std::filesystem::path& output);
  ~Scratch();
  Scratch(Scratch&& other) noexcept : output_(std::move(other.output_)), folder_(std::exchange(other.folder_, {})) {}
  Scratch& operator=(Scratch&&) = delete;

  /// The output, as the user called it.
  const std::filesystem::path& output() const { return output_; }
  std::filesystem::path file(const std::string& name) const { return folder_ / name; }

 private:
  Scratch(std::filesystem::path output, std::filesystem::path folder)
      : output_(std::move(output)), folder_(std::move(folder)) {}
  std::filesystem::path output_, folder_;
};

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

}  // namespace nadir::pyramid
