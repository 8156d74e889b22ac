#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <span>
#include <vector>

#include "levels.h"
#include "nadir/base/progress.h"
#include "nadir/mosaic/mosaic.h"
#include "raw_level.h"
#include "reduction.h"
#include "tile_packer.h"
#include "tile_table.h"
#include "workspace.h"

namespace nadir::pyramid {

/// Takes the packed tiles of a chunk and says where they lie.
using TileSink = std::function<Result<std::uint64_t>(const ChunkRecord& record, std::span<const std::byte> tiles)>;

/// Makes a pyramid, stage by stage: chunks are read from the mosaic or from what the stage before handed on, reduced
/// level by level, and their tiles packed once and for all.
///
/// What a chunk needs beyond its own texels is made again rather than waited for: chunks depend on nothing but the
/// stage before, and may be made in any order, by any number of threads, by other machines.
class Engine {
 public:
  Engine(const mosaic::Mosaic& mosaic, const LevelPlan& plan, const Reduction& reduction, const TilePacker& packer,
         TileTable& table);

  /// Takes over what was done, by an earlier run or by a shard: records that do not fit are left out. What is made from
  /// now on is kept in the last workspace that was taken over.
  /// `tile_file_bytes`: size of the file in which its tiles lie.
  Result<void> take_over(Workspace& workspace, std::uint64_t tile_file_bytes);
  bool is_done(int stage, const Chunk& chunk) const { return done_[static_cast<std::size_t>(stage)].contains(chunk); }

  /// Chunks of a stage that hold data, as far as the sources' outlines or what was handed on tell.
  /// `depth_first`: in Morton order, else row by row.
  std::vector<Chunk> chunks(int stage, bool depth_first) const;

  /// Makes those of `chunks` that are not done yet. A tile at a time is told to `progress`.
  /// The first error ends it once running chunks are done; what is done stays.
  Result<void> run(int stage, std::span<const Chunk> chunks, int workers, const TileSink& sink, Progress& progress);

  /// Of each data band over all level-0 texels; once all stages are done.
  const std::vector<BandStatistics>& statistics() const { return statistics_; }

  /// Bytes that a worker holds at most while it makes a chunk of a stage.
  std::uint64_t worker_bytes() const;
  std::int64_t tiles_in(int stage, const Chunk& chunk) const;

 private:
  struct Scratch;
  std::vector<Window> windows_of(const Stage& stage, const Chunk& chunk) const;
  bool reaches(int stage, const Window& window) const;
  void add_chunks_depth_first(int stage, const Chunk& corner, std::int32_t side, std::vector<Chunk>& found) const;
  Result<ChunkRecord> make(int stage, const Chunk& chunk, const TileSink& sink, Scratch& scratch);
  Result<void> pack(const Stage& stage, Scratch& scratch, ChunkRecord& record) const;
  std::vector<BandStatistics> statistics_of(int stage, const Chunk& chunk, const Block& finest) const;
  bool enter(const ChunkRecord& record, std::uint32_t tile_file, std::uint64_t tile_file_bytes, std::uint32_t raw_file);
  RawLevel& handed_on_by(int stage) const { return *raw_[static_cast<std::size_t>(stage)]; }

  const mosaic::Mosaic& mosaic_;
  const LevelPlan& plan_;
  const TexelType& type_;
  std::vector<Reducer> reducers_;  // [k]: from level k to k + 1
  const TilePacker& packer_;
  TileTable& table_;
  Workspace* workspace_ = nullptr;
  std::uint32_t workspaces_ = 0;
  std::vector<std::unique_ptr<RawLevel>> raw_;  // [s]: what stage s hands on; none of the last
  std::mutex mutex_;                            // guards what `enter` changes, except in raw_
  std::vector<std::set<Chunk>> done_;           // [s]
  std::vector<BandStatistics> statistics_;
};

}  // namespace nadir::pyramid
