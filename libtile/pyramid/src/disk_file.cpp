#include "disk_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <vector>

namespace nadir::pyramid {
namespace {

tl::unexpected<Error> failed(const std::filesystem::path& path, std::string_view what, int error) {
  if (error == ENOSPC || error == EDQUOT || error == EFBIG)
    return fail(Error::Kind::Io,
                fmt::format("{}: {} failed: {}; is the disk full?", path.string(), what, std::strerror(error)));
  return fail(Error::Kind::Io, fmt::format("{}: {} failed: {}", path.string(), what, std::strerror(error)));
}

}  // namespace

Result<DiskFile> DiskFile::open(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor < 0) return failed(path, "opening", errno);
  return DiskFile(path, descriptor);
}

DiskFile::~DiskFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

DiskFile& DiskFile::operator=(DiskFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

Result<std::uint64_t> DiskFile::size() const {
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) return failed(path_, "asking for its size", errno);
  return static_cast<std::uint64_t>(status.st_size);
}

Result<void> DiskFile::resize(std::uint64_t bytes) const {
  if (::ftruncate(descriptor_, static_cast<off_t>(bytes)) != 0) return failed(path_, "setting its size", errno);
  return {};
}

Result<void> DiskFile::write(std::uint64_t offset, std::span<const std::byte> bytes) const {
  while (!bytes.empty()) {
    const ssize_t done = ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return failed(path_, "writing", done == 0 ? ENOSPC : errno);
    bytes = bytes.subspan(static_cast<std::size_t>(done));
    offset += static_cast<std::uint64_t>(done);
  }
  return {};
}

Result<void> DiskFile::read(std::uint64_t offset, std::span<std::byte> out) const {
  return read_rows(offset, out.data(), out.size(), 0, 1);
}

Result<void> DiskFile::read_rows(std::uint64_t offset, std::byte* first_row, std::size_t row_bytes, std::size_t stride,
                                 std::size_t rows) const {
  constexpr std::size_t most_parts = 1024;  // that the kernel takes at once
  std::array<iovec, most_parts> parts;
  std::size_t row = 0, begun = 0;  // bytes of the row that are there
  while (row < rows) {
    const std::size_t count = std::min(rows - row, most_parts);
    for (std::size_t i = 0; i < count; ++i) parts[i] = {first_row + (row + i) * stride, row_bytes};
    parts[0] = {first_row + row * stride + begun, row_bytes - begun};
    const ssize_t done = ::preadv(descriptor_, parts.data(), static_cast<int>(count), static_cast<off_t>(offset));
    if (done < 0 && errno == EINTR) continue;
    if (done < 0) return failed(path_, "reading", errno);
    if (done == 0)
      return fail(Error::Kind::Io, fmt::format("{}: reading failed: it ends at byte {}", path_.string(), offset));
    offset += static_cast<std::uint64_t>(done);
    const std::size_t reached = begun + static_cast<std::size_t>(done);
    row += reached / row_bytes;
    begun = reached % row_bytes;
  }
  return {};
}

Result<void> DiskFile::copy_from(const DiskFile& from, std::uint64_t from_offset, std::uint64_t to_offset,
                                 std::uint64_t bytes) const {
  while (bytes > 0) {
    auto in = static_cast<off_t>(from_offset), out = static_cast<off_t>(to_offset);
    ssize_t done = ::copy_file_range(from.descriptor_, &in, descriptor_, &out, bytes, 0);
    if (done < 0 && errno == EINTR) continue;
    if (done < 0 && (errno == EXDEV || errno == EINVAL || errno == ENOSYS || errno == EOPNOTSUPP)) {
      static thread_local std::vector<std::byte> buffer(1 << 20);
      const auto part = std::span(buffer).first(std::min<std::uint64_t>(bytes, buffer.size()));
      if (const auto ok = from.read(from_offset, part); !ok) return ok;
      if (const auto ok = write(to_offset, part); !ok) return ok;
      done = static_cast<ssize_t>(part.size());
    }
    if (done < 0) return failed(path_, "writing", errno);
    if (done == 0)
      return fail(Error::Kind::Io,
                  fmt::format("{}: reading failed: it ends at byte {}", from.path_.string(), from_offset));
    from_offset += static_cast<std::uint64_t>(done);
    to_offset += static_cast<std::uint64_t>(done);
    bytes -= static_cast<std::uint64_t>(done);
  }
  return {};
}

bool DiskFile::lock() const { return ::flock(descriptor_, LOCK_EX | LOCK_NB) == 0; }

}  // namespace nadir::pyramid
