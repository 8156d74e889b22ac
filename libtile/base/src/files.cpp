#include "nadir/base/files.h"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>

namespace nadir {
namespace fs = std::filesystem;
namespace {

struct CloseFile {
  void operator()(std::FILE* file) const noexcept { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

std::string reason(int error) { return std::strerror(error); }

}  // namespace

Result<std::string> read_text_file(const fs::path& path, std::size_t limit_bytes) {
  std::error_code error;
  const auto status = fs::status(path, error);
  if (!fs::exists(status)) return fail(Error::Kind::NotFound, fmt::format("{}: no such file", path.string()));
  if (fs::is_directory(status))
    return fail(Error::Kind::Malformed, fmt::format("{}: expected a file, found a folder", path.string()));
  const File file{std::fopen(path.c_str(), "rb")};
  if (!file) return fail(Error::Kind::Io, fmt::format("{}: {}", path.string(), reason(errno)));

  std::string text;
  char block[1 << 16];
  while (const std::size_t n = std::fread(block, 1, sizeof block, file.get())) {
    text.append(block, n);
    if (text.size() > limit_bytes)
      return fail(Error::Kind::Malformed,
                  fmt::format("{}: expected a text file of at most {} bytes", path.string(), limit_bytes));
  }
  if (std::ferror(file.get()))
    return fail(Error::Kind::Io, fmt::format("{}: reading failed: {}", path.string(), reason(errno)));
  return text;
}

Result<void> write_file(const fs::path& path, std::string_view bytes) {
  std::error_code error;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
  const fs::path temporary = temporary_name(path);
  int problem = 0;
  {
    File file{std::fopen(temporary.c_str(), "wb")};
    if (!file) return fail(Error::Kind::Io, fmt::format("{}: cannot write: {}", path.string(), reason(errno)));
    if (std::fwrite(bytes.data(), 1, bytes.size(), file.get()) != bytes.size() || std::fflush(file.get()) != 0)
      problem = errno;
  }
  if (problem != 0) {
    fs::remove(temporary, error);
    return fail(Error::Kind::Io,
                fmt::format("{}: writing failed: {}; nothing was left behind", path.string(), reason(problem)));
  }
  return move_into_place(temporary, path);
}

fs::path temporary_name(const fs::path& path) {
  static std::atomic<unsigned> counter{0};
  return path.parent_path() /
         fmt::format(".{}.{}-{}.part{}", path.stem().string(), ::getpid(), counter++, path.extension().string());
}

Result<void> move_into_place(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::rename(from, to, error);
  if (!error) return {};
  const std::string message = fmt::format("{}: cannot be put in place: {}", to.string(), error.message());
  fs::remove(from, error);
  return fail(Error::Kind::Io, message);
}

Result<void> refuse_to_overwrite(const fs::path& path, bool force) {
  std::error_code error;
  const bool there = fs::is_directory(path, error) ? !fs::is_empty(path, error) : fs::exists(path, error);
  if (!there || force) return {};
  return fail(Error::Kind::Exists,
              fmt::format("{}: is there already; choose another name, or --force to replace it", path.string()));
}

}  // namespace nadir
