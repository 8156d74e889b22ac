#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "journal.h"
#include "nadir/tiff/cog.h"

namespace nadir::pyramid {

/// The folder beside the output in which a build keeps what it has done: it stays when the process ends early, and the
/// next run with the same sources and options goes on from there.
class Workspace {
 public:
  /// Exists where another process is at it.
  static Result<std::unique_ptr<Workspace>> open(const std::filesystem::path& folder, const BuildIdentity& identity);
  /// One that another process has finished, as a shard of a build.
  static Result<std::unique_ptr<Workspace>> open_shard(const std::filesystem::path& folder);
  ~Workspace();
  Workspace(const Workspace&) = delete;
  Workspace& operator=(const Workspace&) = delete;

  std::filesystem::path file(const std::string& name) const { return folder_ / name; }
  const BuildIdentity& identity() const { return identity_; }
  Journal& journal() { return *journal_; }
  const DiskFile& spool() const { return spool_; }
  /// Bytes in the spool, whoever wrote them.
  Result<std::uint64_t> spool_size() const { return spool_.size(); }

  /// Appends packed tiles to the spool. Where they lie.
  Result<std::uint64_t> spool(std::span<const std::byte> bytes);

  /// Whether the folder goes with this object: it has served, or nothing in it is worth keeping.
  void discard() { keep_ = false; }
  void keep() { keep_ = true; }

 private:
  explicit Workspace(std::filesystem::path folder) : folder_(std::move(folder)) {}
  Result<void> open_spool();

  std::filesystem::path folder_;
  BuildIdentity identity_;
  DiskFile lock_, spool_;
  std::optional<Journal> journal_;
  std::atomic<std::uint64_t> end_{0};
  bool keep_ = true;
};

}  // namespace nadir::pyramid
