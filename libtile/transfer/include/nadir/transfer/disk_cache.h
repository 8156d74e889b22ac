#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace nadir::transfer {

/// Which bytes a URL stood for when it was asked.
struct FileVersion {
  std::uint64_t size = 0;
  std::string etag;           // with its quotes; empty where the server names none
  std::string last_modified;  // as the server wrote it; empty likewise

  /// Whether the server will know this version again. Without, nothing of it may be kept.
  bool can_be_checked() const { return !etag.empty() || !last_modified.empty(); }
  friend bool operator==(const FileVersion&, const FileVersion&) = default;
};

/// Blocks of remote files in a folder, for this process and others at the same time.
///
/// A block is a file of its own, named by a hash of URL, version and place, written under another name first and
/// carrying a checksum: whatever another process or a crash did, a block is right or absent. A cache never fails a
/// read: where it cannot write, it says so in `writable()` and writes no more. Thread-safe.
class DiskCache {
 public:
  /// Reads smaller than this cost one block each. 64 KiB come in about the time of the journey at 10 Mbit/s and 50 ms,
  /// and hold the index of most files.
  static constexpr std::uint64_t block_bytes = 64 << 10;
  /// Identifies a version of a file among all.
  using FileKey = std::array<std::uint64_t, 2>;

  /// `budget_bytes` > 0. Nothing is made on disk before the first block is kept.
  DiskCache(std::filesystem::path folder, std::uint64_t budget_bytes)
      : folder_(std::move(folder)), budget_bytes_(budget_bytes) {}
  /// Writes what is left to write.
  ~DiskCache();
  /// The one of this process for that folder and budget.
  static std::shared_ptr<DiskCache> shared(const std::filesystem::path& folder, std::uint64_t budget_bytes);
  /// $XDG_CACHE_HOME/nadir, else ~/.cache/nadir; empty where the environment names neither.
  static std::filesystem::path default_folder();

  const std::filesystem::path& folder() const { return folder_; }
  static FileKey file_key(std::string_view url, const FileVersion& version);

  /// The version of `url` that was last seen, where it is known.
  std::optional<FileVersion> version(std::string_view url);
  void remember_version(std::string_view url, const FileVersion& version);

  /// Fills `out`, the whole of the file's block `index`; false where it is not kept, or damaged and now gone.
  bool load(const FileKey& file, std::uint64_t index, std::span<std::byte> out);
  /// Keeps a block: a thread of the cache writes it, so that no reader waits for the disk, and `load` has it at once.
  /// Where more than 64 MiB wait, the caller writes it himself. `failed` is called where it could not be kept.
  void store(const FileKey& file, std::uint64_t index, std::span<const std::byte> block, std::function<void()> failed);
  /// Waits until nothing is left to write.
  void finish_writing();
  /// Whether every block so far could be kept.
  bool writable() const { return writable_; }

 private:
  struct Block {
    std::vector<std::byte> bytes;
    std::function<void()> failed;
  };
  void write_block(const FileKey& key, const Block& block);
  void work();
  bool write(const std::filesystem::path& path, std::string_view bytes);
  void make_room(std::uint64_t bytes);

  const std::filesystem::path folder_;
  const std::uint64_t budget_bytes_;
  std::atomic<bool> writable_{true};
  std::mutex room_mutex_;  // guards the two below, and lets one thread at a time look through the folder
  std::optional<std::uint64_t> used_bytes_;  // at the last look and written since; none before the first
  std::uint64_t written_since_look_ = 0;

  std::mutex queue_mutex_;  // guards what follows; never held while writing
  std::condition_variable queue_changed_;
  std::map<FileKey, std::shared_ptr<const Block>> waiting_;  // by key of the block, the one being written too
  std::deque<FileKey> order_;
  std::uint64_t waiting_bytes_ = 0;
  bool closing_ = false;
  std::thread worker_;
};

}  // namespace nadir::transfer
