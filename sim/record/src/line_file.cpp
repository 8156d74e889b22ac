#include "nadir/record/line_file.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>

namespace nadir::record {
namespace fs = std::filesystem;

Result<FilePtr> create_file(const fs::path& path) {
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  FilePtr file(std::fopen(path.c_str(), "wb"));
  if (!file) return fail(Error::Kind::Io, fmt::format("{}: cannot write: {}", path.string(), std::strerror(errno)));
  return file;
}

Error write_error(const fs::path& path) {
  return {Error::Kind::Io, fmt::format("{}: writing failed: {}", path.string(), std::strerror(errno))};
}

Result<LineFile> LineFile::create(const fs::path& path, const std::string& header) {
  LineFile file;
  file.path_ = path;
  auto opened = create_file(path);
  if (!opened) return fail(opened);
  file.file_ = std::move(*opened);
  if (!header.empty())
    if (auto ok = file.add(header); !ok) return fail(ok);
  return file;
}

Result<void> LineFile::add(const std::string& line) {
  if (std::fwrite(line.data(), 1, line.size(), file_.get()) == line.size() && std::fputc('\n', file_.get()) != EOF)
    return {};
  return tl::unexpected(write_error(path_));
}

Result<void> LineFile::close() {
  if (std::fflush(file_.get()) == 0) return {};
  return tl::unexpected(write_error(path_));
}

}  // namespace nadir::record
