#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "nadir/base/result.h"

namespace nadir::record {

struct CloseFile {
  void operator()(std::FILE* file) const noexcept { std::fclose(file); }
};
using FilePtr = std::unique_ptr<std::FILE, CloseFile>;

/// A new file to write, in a folder that is made where it is missing.
Result<FilePtr> create_file(const std::filesystem::path& path);
/// That writing to a file failed, and why, as the system's last error says.
Error write_error(const std::filesystem::path& path);

/// A text file that grows line by line.
class LineFile {
 public:
  static Result<LineFile> create(const std::filesystem::path& path, const std::string& header);
  Result<void> add(const std::string& line);
  Result<void> close();

 private:
  std::filesystem::path path_;
  FilePtr file_;
};

}  // namespace nadir::record
