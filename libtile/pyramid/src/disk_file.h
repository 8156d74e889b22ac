#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <utility>

#include "nadir/base/result.h"

namespace nadir::pyramid {

/// A file on disk, read and written at any place. Errors name it and say what to do.
/// Thread-safe where threads write to different places.
class DiskFile {
 public:
  /// Opens for reading and writing; makes it where it is missing.
  static Result<DiskFile> open(const std::filesystem::path& path);
  DiskFile() = default;
  ~DiskFile();
  DiskFile(DiskFile&& other) noexcept
      : path_(std::move(other.path_)), descriptor_(std::exchange(other.descriptor_, -1)) {}
  DiskFile& operator=(DiskFile&& other) noexcept;

  const std::filesystem::path& path() const { return path_; }
  Result<std::uint64_t> size() const;
  Result<void> resize(std::uint64_t bytes) const;

  Result<void> write(std::uint64_t offset, std::span<const std::byte> bytes) const;
  /// Error::Io too where the file ends before.
  Result<void> read(std::uint64_t offset, std::span<std::byte> out) const;
  /// Fills `rows` rows of `row_bytes` bytes, `stride` bytes apart in memory, from bytes that lie together in the file.
  Result<void> read_rows(std::uint64_t offset, std::byte* first_row, std::size_t row_bytes, std::size_t stride,
                         std::size_t rows) const;
  /// Copies within the kernel, where the disk can without moving bytes.
  Result<void> copy_from(const DiskFile& from, std::uint64_t from_offset, std::uint64_t to_offset,
                         std::uint64_t bytes) const;

  /// False where another process holds it. The lock goes with the process.
  bool lock() const;

 private:
  DiskFile(std::filesystem::path path, int descriptor) : path_(std::move(path)), descriptor_(descriptor) {}
  std::filesystem::path path_;
  int descriptor_ = -1;
};

}  // namespace nadir::pyramid
