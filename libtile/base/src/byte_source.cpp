#include "nadir/base/byte_source.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace nadir {

Result<void> ByteSource::read_many(std::span<const ByteRequest> requests) const {
  for (const ByteRequest& request : requests)
    if (auto ok = read(request.offset, request.out); !ok) return ok;
  return {};
}

Result<std::shared_ptr<const LocalFile>> LocalFile::open(const std::string& path, IfWritten if_written) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);  // a pipe must not block
  if (descriptor < 0)
    return errno == ENOENT || errno == ENOTDIR
               ? fail(Error::Kind::NotFound, fmt::format("{}: no such file", path))
               : fail(Error::Kind::Io, fmt::format("{}: cannot be opened: {}", path, std::strerror(errno)));
  struct stat status = {};
  if (::fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) {
    ::close(descriptor);
    return fail(Error::Kind::Malformed, fmt::format("{}: expected a file, found {}", path,
                                                    S_ISDIR(status.st_mode) ? "a folder" : "a device or pipe"));
  }
  return std::shared_ptr<const LocalFile>(new LocalFile(path, descriptor, status, if_written));
}

LocalFile::LocalFile(std::string path, int descriptor, const struct stat& status, IfWritten if_written)
    : path_(std::move(path)),
      descriptor_(descriptor),
      size_(static_cast<std::uint64_t>(status.st_size)),
      modified_(status.st_mtim),
      if_written_(if_written) {}

LocalFile::~LocalFile() { ::close(descriptor_); }

Result<void> LocalFile::read(std::uint64_t offset, std::span<std::byte> out) const {
  while (!out.empty()) {
    const ssize_t got = ::pread(descriptor_, out.data(), out.size(), static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0)
      return fail(Error::Kind::Io, fmt::format("{}: byte {}: cannot be read: {}", path_, offset, std::strerror(errno)));
    if (got == 0)
      return fail(Error::Kind::Io,
                  fmt::format("{}: ends at byte {}, where {} more were expected; it had {} bytes when it was opened",
                              path_, offset, out.size(), size_));
    offset += static_cast<std::uint64_t>(got);
    out = out.subspan(static_cast<std::size_t>(got));
  }
  return if_written_ == IfWritten::Fail ? check_unwritten() : Result<void>{};
}

/// What was read before is then of the file as it was opened.
Result<void> LocalFile::check_unwritten() const {
  struct stat now = {};
  if (::fstat(descriptor_, &now) == 0 && now.st_mtim.tv_sec == modified_.tv_sec &&
      now.st_mtim.tv_nsec == modified_.tv_nsec)
    return {};
  return fail(Error::Kind::Io, fmt::format("{}: was written to while it was in use: open it again", path_));
}

}  // namespace nadir
