#pragma once

#include <sys/stat.h>

#include <cstddef>
#include <cstdint>
#include <ctime>
#include <memory>
#include <span>
#include <string>

#include "nadir/base/result.h"

namespace nadir {

/// Where bytes are wanted from, and where they go.
struct ByteRequest {
  std::uint64_t offset = 0;
  std::span<std::byte> out;
};

/// The bytes of one file, wherever it lies, read in any order.
/// Thread-safe.
class ByteSource {
 public:
  virtual ~ByteSource() = default;

  /// Path or URL, for messages.
  virtual const std::string& name() const = 0;
  /// Bytes in all, as they were when it was opened.
  virtual std::uint64_t size() const = 0;
  /// Whether a read takes a journey: then those that are known beforehand are better asked for together.
  virtual bool is_remote() const { return false; }

  /// Fills `out` from `offset` on, wholly or with an Error.
  virtual Result<void> read(std::uint64_t offset, std::span<std::byte> out) const = 0;
  /// Fills all of `requests`; the first error, where there is one, leaves their contents undefined.
  virtual Result<void> read_many(std::span<const ByteRequest> requests) const;
};

/// What reads of a file do once somebody has written to it, by its time of modification, which the system may advance
/// by steps of milliseconds.
enum class IfWritten { ReadOn, Fail };

/// A file on disk. Deleted, or replaced by another of its name, it is read on.
class LocalFile : public ByteSource {
 public:
  /// NotFound where there is none, Malformed where it is no file.
  static Result<std::shared_ptr<const LocalFile>> open(const std::string& path,
                                                       IfWritten if_written = IfWritten::ReadOn);
  ~LocalFile() override;
  LocalFile(const LocalFile&) = delete;
  LocalFile& operator=(const LocalFile&) = delete;

  const std::string& name() const override { return path_; }
  std::uint64_t size() const override { return size_; }
  Result<void> read(std::uint64_t offset, std::span<std::byte> out) const override;

 private:
  LocalFile(std::string path, int descriptor, const struct stat& status, IfWritten if_written);
  Result<void> check_unwritten() const;
  const std::string path_;
  const int descriptor_;
  const std::uint64_t size_;
  const std::timespec modified_;
  const IfWritten if_written_;
};

}  // namespace nadir
