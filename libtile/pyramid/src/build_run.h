#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "assemble.h"
#include "design.h"
#include "engine.h"
#include "workspace.h"

namespace nadir::pyramid {

/// One build from its plan to the finished file: which chunks, by whom, where tiles go, what is kept for a next run.
class BuildRun {
 public:
  /// `options` and `design` outlive it. OverBudget where a chunk does not fit into the memory allowed.
  static Result<std::unique_ptr<BuildRun>> plan(const BuildOptions& options, Design& design);

  /// How it is done, a line a step.
  std::vector<std::string> explain() const;

  /// Makes all tiles, or those of a shard. What is done stays when it fails, and its Error says so.
  Result<void> make_tiles();

  /// Puts the map together in the build's folder. Its path; nothing more to be done for a shard.
  Result<std::filesystem::path> put_together();

  /// The map is in place: the build's own files go, and those of the shards that it joined.
  void clean_up();

  void fill(BuildReport& report) const;
  std::filesystem::path folder() const;  // of what is kept

 private:
  BuildRun(const BuildOptions& options, Design& design, TilePacker packer, int depth);
  std::uint64_t raw_bytes() const;  // of all levels
  Result<BuildIdentity> identity() const;
  Result<void> open_workspaces();
  Result<void> open_shards(const BuildIdentity& identity);
  Result<void> lay_out_in_place();
  bool must_be_spooled(const mosaic::Layer& layer) const;
  Result<void> spool_sources();
  Result<void> run_stages();
  std::vector<Chunk> own_part(std::vector<Chunk> chunks) const;
  Result<std::uint64_t> store(const ChunkRecord& record, std::span<const std::byte> tiles);
  Result<void> check_space_left();
  Result<tiff::CogArrangement> arrange(std::span<const tiff::TileSizes> sizes) const;

  const BuildOptions& options_;
  Design& design_;
  const TilePacker packer_;
  const LevelPlan plan_;
  TileTable table_;
  Engine engine_;
  int workers_ = 1;
  bool depth_first_ = true, in_place_ = false;

  std::vector<std::unique_ptr<Workspace>> shards_;
  std::unique_ptr<Workspace> workspace_;
  std::optional<DiskFile> map_;
  std::mutex map_mutex_;              // guards writing to map_ in place
  tiff::CogArrangement arrangement_;  // known beforehand where tiles are written in place
  std::int64_t tiles_to_pack_ = 0, kept_chunks_ = 0;
  std::atomic<std::int64_t> packed_tiles_{0};
  std::atomic<std::uint64_t> packed_bytes_{0}, space_checked_at_{0};
};

}  // namespace nadir::pyramid
