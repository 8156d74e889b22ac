#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <vector>

#include "disk_file.h"
#include "levels.h"
#include "reduction.h"

namespace nadir::pyramid {

/// Bytes of one packed tile and of its mask, without leaders and trailers; 0: there is none.
struct PackedSize {
  std::uint32_t imagery = 0, mask = 0;
};

/// What is known of a chunk that is done.
struct ChunkRecord {
  std::int32_t stage = 0;
  Chunk chunk;
  bool holds_data = false;                 // else it is empty, and nothing else is set
  std::uint64_t tiles_at = 0;              // in the spool: tiles behind one another, level by level, row by row
  std::vector<PackedSize> tiles;           // in that order
  std::vector<float> losses;               // in that order, data bands interleaved; none of the coarsest level
  std::uint64_t handed_on_at = 0;          // in the file of the level handed on
  std::vector<BandStatistics> statistics;  // of its level-0 texels, per data band
};

/// What must be the same for work done earlier to be of use.
struct BuildIdentity {
  std::uint64_t fingerprint[2] = {};      // of sources and options
  std::int32_t tile_size = 0, depth = 0;  // of the LevelPlan
  std::int32_t shard = 0, shards = 1;
  friend bool operator==(const BuildIdentity&, const BuildIdentity&) = default;
};

/// What has been done, on disk: a record a chunk, appended once all that it tells of is written.
///
/// Each record has a checksum. What follows the first that is cut short or damaged is given up: those chunks are made
/// again. Nothing in the file is trusted further than its checksum.
/// Thread-safe.
class Journal {
 public:
  /// Opens `file` and reads what is there. Where it is of another build, or none, it begins anew.
  static Result<Journal> open(DiskFile file, const BuildIdentity& identity);
  Journal(Journal&& other) noexcept;

  /// What is in a journal of any build; Malformed where it is none.
  static Result<BuildIdentity> identity(const DiskFile& file);

  const std::vector<ChunkRecord>& records() const { return records_; }  // as they were when it was opened
  bool is_new() const { return is_new_; }                               // there was none, or of another build
  void forget_records() { records_ = {}; }

  Result<void> append(const ChunkRecord& record);
  std::int64_t appended() const { return appended_; }

 private:
  explicit Journal(DiskFile file) : file_(std::move(file)) {}
  Result<void> read_records();

  DiskFile file_;
  std::vector<ChunkRecord> records_;
  bool is_new_ = false;
  std::mutex mutex_;  // guards end_ and the order of what is appended
  std::uint64_t end_ = 0;
  std::atomic<std::int64_t> appended_{0};
};

}  // namespace nadir::pyramid
