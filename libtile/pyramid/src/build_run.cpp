#include "build_run.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <thread>

#include "nadir/base/progress.h"
#include "nadir/base/text.h"
#include "spooled_source.h"

namespace nadir::pyramid {
namespace fs = std::filesystem;
namespace {

constexpr std::uint64_t statistics_room = 1024;  // in the header, for each band's

int threads_of(const BuildOptions& options) {
  return options.threads > 0 ? options.threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

/// A block that reaches far beyond a chunk would be decoded for each chunk in its row, were they not made row by row.
bool has_wide_blocks(const mosaic::Mosaic& mosaic, const LevelPlan& plan) {
  const auto chunk_side = std::int64_t{plan.tile_size()} << plan.depth();
  return std::any_of(mosaic.layers().begin(), mosaic.layers().end(), [&](const mosaic::Layer& layer) {
    return !layer.source->plain() && layer.source->block().width > chunk_side;
  });
}

std::uint64_t unpacked_bytes(const mosaic::Source& source, const TexelType& type) {
  return static_cast<std::uint64_t>(source.width()) * static_cast<std::uint64_t>(source.height()) *
         (type.texel_bytes() + (type.mask ? 1 : 0));
}

Result<void> require_space(const fs::path& folder, std::uint64_t bytes, std::string_view what) {
  std::error_code error;
  const auto space = fs::space(folder, error);
  if (error || space.available >= bytes) return {};
  return fail(Error::Kind::Io, fmt::format("{}: {} takes {}, and its disk has {} left: make room, or choose another "
                                           "disk for the output",
                                           folder.string(), what, format_bytes(bytes), format_bytes(space.available)));
}

}  // namespace

BuildRun::BuildRun(const BuildOptions& options, Design& design, TilePacker packer, int depth)
    : options_(options),
      design_(design),
      packer_(std::move(packer)),
      plan_({design.mosaic.width(), design.mosaic.height()}, options.tile_size, depth),
      table_(plan_, design.mosaic.type().data_bands(), design.mosaic.type().mask),
      engine_(design.mosaic, plan_, design.reduction, packer_, table_) {}

Result<std::unique_ptr<BuildRun>> BuildRun::plan(const BuildOptions& options, Design& design) {
  const TexelType& type = design.mosaic.type();
  std::unique_ptr<BuildRun> run;
  for (int depth = choose_depth(design.mosaic, options.tile_size); depth > 0; --depth) {
    auto packer = make_packer(design, options);
    if (!packer) return fail(packer);
    run.reset(new BuildRun(options, design, std::move(*packer), depth));
    // A quarter is for blocks of sources that are kept.
    if (run->engine_.worker_bytes() <= options.memory_bytes / 4 * 3) break;
  }
  const std::uint64_t each = run->engine_.worker_bytes(), room = options.memory_bytes / 4 * 3;
  if (each > room)
    return fail(
        Error::Kind::OverBudget,
        fmt::format("memory {}: one thread needs {} for tiles of {} x {} texels: give it {}, or choose a smaller "
                    "--tile-size",
                    format_bytes(options.memory_bytes), format_bytes(each), options.tile_size, options.tile_size,
                    format_bytes(each / 3 * 4 + (1 << 20))));
  run->workers_ =
      static_cast<int>(std::min<std::uint64_t>(static_cast<std::uint64_t>(threads_of(options)), room / each));
  run->depth_first_ = !has_wide_blocks(design.mosaic, run->plan_);
  run->in_place_ =
      options.compression == Compression::None && !tells_holes(type) && !options.shard && options.join == 0;
  // Who waits to write leaves a core idle, were there not another.
  if (run->in_place_ && static_cast<std::uint64_t>(run->workers_ + 1) * each <= room) ++run->workers_;
  return run;
}

fs::path BuildRun::folder() const {
  fs::path name = options_.output;
  name += options_.shard ? fmt::format(".shard-{}-of-{}", options_.shard->number, options_.shard->count) : ".building";
  return name;
}

std::uint64_t BuildRun::raw_bytes() const {
  std::uint64_t texels = 0;
  for (const LevelSize& size : plan_.sizes())
    texels += static_cast<std::uint64_t>(size.width) * static_cast<std::uint64_t>(size.height);
  return texels * design_.mosaic.type().texel_bytes();
}

std::vector<std::string> BuildRun::explain() const {
  const auto& layers = design_.mosaic.layers();
  const TexelType& type = design_.mosaic.type();
  const auto copied = std::count_if(layers.begin(), layers.end(), [](const mosaic::Layer& layer) {
    return !layer.placement || layer.placement->shift();
  });
  const auto warped = static_cast<std::ptrdiff_t>(layers.size()) - copied;
  std::vector<std::string> lines;
  lines.push_back(fmt::format("map: {} x {} texels{}", design_.mosaic.width(), design_.mosaic.height(),
                              design_.mosaic.grid() ? ", " + design_.mosaic.grid()->projection.name() : ""));
  lines.push_back(fmt::format("sources: {} copied texel for texel, {} warped", copied, warped) +
                  (warped > 0 ? fmt::format(" within {} texels", options_.tolerance_texels) : ""));
  lines.push_back(
      fmt::format("levels: {}, each from the one before by {}", plan_.sizes().size(), describe(design_.reduction)));
  lines.push_back(fmt::format("tiles: {0} x {0} texels, {1}{2}", options_.tile_size, to_string(options_.compression),
                              tells_holes(type) ? "; none where nothing is valid" : ""));
  const std::int64_t side = std::int64_t{options_.tile_size} << plan_.depth();
  lines.push_back(fmt::format("work: squares of {0} x {0} texels {1}, by {2} {3} with {4} each", side,
                              depth_first_ ? "depth first" : "row by row, since a source is stored in wide strips",
                              workers_, workers_ == 1 ? "thread" : "threads", format_bytes(engine_.worker_bytes())));
  for (const mosaic::Layer& layer : layers)
    if (must_be_spooled(layer))
      lines.push_back(
          fmt::format("{}: packed in strips wider than memory holds for a row of squares: unpacked to disk "
                      "once, {}",
                      layer.source->label(), format_bytes(unpacked_bytes(*layer.source, type))));
  if (in_place_)
    lines.push_back(fmt::format("disk: {}, tiles are written where they stay", format_bytes(raw_bytes())));
  else
    lines.push_back(fmt::format("disk: up to {}, since tiles are spooled in {} and put in order at the end",
                                format_bytes(2 * raw_bytes()), folder().filename().string()));
  return lines;
}

/// All that decides what is in the file, and when the sources were last changed.
Result<BuildIdentity> BuildRun::identity() const {
  const auto image = describe_file(design_, options_, packer_, plan_.sizes(), nullptr);
  if (!image) return fail(image);
  std::string text = fmt::format(
      "1 {} {} {} {} {} {} {} {} {} {}", design_.mosaic.width(), design_.mosaic.height(), describe(design_.reduction),
      to_string(options_.compression), options_.level.value_or(0), static_cast<int>(packer_.imagery_format().predictor),
      options_.quality.value_or(0), options_.subsample_chroma, options_.max_error, options_.tolerance_texels);
  for (const auto& fields : {image->fields, image->shared_fields})
    for (const tiff::NewField& field : fields)
      text.append(reinterpret_cast<const char*>(field.values.data()), field.values.size());
  for (const mosaic::Layer& layer : design_.mosaic.layers()) {
    std::error_code error;
    const fs::path path = layer.source->label();
    const auto size = fs::is_regular_file(path, error) ? fs::file_size(path, error) : 0;
    const auto changed = fs::last_write_time(path, error).time_since_epoch().count();
    text += fmt::format("\n{} {} {} {} {}", fs::absolute(path, error).string(), size, changed, layer.covered.x,
                        layer.covered.y);
  }
  const XXH128_hash_t hash = XXH3_128bits(text.data(), text.size());
  BuildIdentity identity;
  identity.fingerprint[0] = hash.high64;
  identity.fingerprint[1] = hash.low64;
  identity.tile_size = plan_.tile_size();
  identity.depth = plan_.depth();
  if (options_.shard) {
    identity.shard = options_.shard->number;
    identity.shards = options_.shard->count;
  }
  return identity;
}

Result<void> BuildRun::open_workspaces() {
  const auto identity = this->identity();
  if (!identity) return fail(identity);
  if (const auto ok = open_shards(*identity); !ok) return ok;
  auto workspace = Workspace::open(folder(), *identity);
  if (!workspace) return fail(workspace);
  workspace_ = std::move(*workspace);
  kept_chunks_ = static_cast<std::int64_t>(workspace_->journal().records().size());
  if (kept_chunks_ == 0) workspace_->discard();  // until something is worth keeping
  if (in_place_)
    if (const auto ok = lay_out_in_place(); !ok) return ok;
  const auto tile_file_bytes = in_place_ ? Result<std::uint64_t>(arrangement_.file_bytes) : workspace_->spool_size();
  if (!tile_file_bytes) return fail(tile_file_bytes);
  return engine_.take_over(*workspace_, *tile_file_bytes);
}

Result<void> BuildRun::open_shards(const BuildIdentity& identity) {
  for (int number = 1; number <= options_.join; ++number) {
    fs::path folder = options_.output;
    folder += fmt::format(".shard-{}-of-{}", number, options_.join);
    auto shard = Workspace::open_shard(folder);
    if (!shard) return fail(shard);
    BuildIdentity expected = identity;
    expected.shard = number;
    expected.shards = options_.join;
    if ((*shard)->identity() != expected)
      return fail(
          Error::Kind::Malformed,
          fmt::format("{}: was built from other sources or with other options, or they changed since: build the "
                      "shard again",
                      folder.string()));
    const auto size = (*shard)->spool_size();
    if (!size) return fail(size);
    if (const auto ok = engine_.take_over(**shard, *size); !ok) return ok;
    shards_.push_back(std::move(*shard));
  }
  if (options_.join == 0) return {};
  const auto chunks = engine_.chunks(0, depth_first_);
  const auto missing =
      std::count_if(chunks.begin(), chunks.end(), [&](const Chunk& chunk) { return !engine_.is_done(0, chunk); });
  if (missing > 0)
    return fail(
        Error::Kind::NotFound,
        fmt::format("{}: {} of {} squares are missing: some shard has not ended; run it again, it goes on where "
                    "it stopped",
                    options_.output.string(), missing, chunks.size()));
  return {};
}

/// The same room for statistics in every case, so that the file does not tell how it was made.
Result<tiff::CogArrangement> BuildRun::arrange(std::span<const tiff::TileSizes> sizes) const {
  const auto image = describe_file(design_, options_, packer_, plan_.sizes(), nullptr);
  if (!image) return fail(image);
  const std::uint64_t spare = statistics_room * static_cast<std::uint64_t>(design_.mosaic.type().bands);
  return tiff::arrange(*image, sizes, table_.losses(), spare);
}

Result<void> BuildRun::lay_out_in_place() {
  std::vector<tiff::TileSizes> sizes = table_.sizes();
  for (tiff::TileSizes& level : sizes)
    std::fill(level.imagery.begin(), level.imagery.end(),
              static_cast<std::uint32_t>(packer_.imagery_format().tile_bytes()));
  auto arrangement = arrange(sizes);
  if (!arrangement) return fail(arrangement);
  arrangement_ = std::move(*arrangement);
  auto map = DiskFile::open(workspace_->file("map.tif"));
  if (!map) return fail(map);
  map_ = std::move(*map);
  const auto there = map_->size();
  if (!there) return fail(there);
  if (*there == arrangement_.file_bytes) return {};
  if (const auto ok = require_space(workspace_->file(""), arrangement_.file_bytes, "the map"); !ok) return ok;
  return map_->resize(arrangement_.file_bytes);
}

Result<std::uint64_t> BuildRun::store(const ChunkRecord& record, std::span<const std::byte> tiles) {
  if (in_place_) {
    // One at a time, as the kernel would have it, but without its busy waiting.
    const std::scoped_lock lock(map_mutex_);
    if (const auto ok = write_tiles_in_place(*map_, arrangement_, plan_, record, tiles); !ok) return fail(ok);
    return 0;
  }
  const auto at = workspace_->spool(tiles);
  if (!at) return at;
  packed_tiles_ += static_cast<std::int64_t>(record.tiles.size());
  packed_bytes_ += tiles.size();
  if (const auto ok = check_space_left(); !ok) return fail(ok);
  return at;
}

/// From the tiles packed so far: what is still to come, and all of it again when it is put in order.
Result<void> BuildRun::check_space_left() {
  constexpr std::uint64_t between_checks = 64 << 20;
  const std::uint64_t packed = packed_bytes_;
  std::uint64_t last = space_checked_at_;
  if (packed < last + between_checks || !space_checked_at_.compare_exchange_strong(last, packed)) return {};
  const double share =
      static_cast<double>(packed_tiles_) / static_cast<double>(std::max<std::int64_t>(1, tiles_to_pack_));
  const double all = static_cast<double>(packed) / std::clamp(share, 1e-6, 1.0);
  const double left = options_.shard ? all - static_cast<double>(packed) : 2 * all - static_cast<double>(packed);
  return require_space(workspace_->file(""), static_cast<std::uint64_t>(std::max(0.0, left)), "the rest of the map");
}

/// A shard takes every so many squares of the depth-first order that lie behind one another.
std::vector<Chunk> BuildRun::own_part(std::vector<Chunk> chunks) const {
  if (!options_.shard) return chunks;
  const auto count = static_cast<std::size_t>(options_.shard->count),
             i = static_cast<std::size_t>(options_.shard->number);
  const auto border = [&](std::size_t part) {
    return chunks.begin() + static_cast<std::ptrdiff_t>(chunks.size() * part / count);
  };
  std::vector<Chunk> part(border(i - 1), border(i));
  return part;
}

/// Whether a row of chunks needs more of a source's wide blocks than can be kept.
bool BuildRun::must_be_spooled(const mosaic::Layer& layer) const {
  const mosaic::Window block = layer.source->block();
  const std::int64_t side = std::int64_t{plan_.tile_size()} << plan_.depth();
  if (layer.source->plain() || block.width <= side) return false;
  const std::uint64_t rows = static_cast<std::uint64_t>(side + 2 * std::int64_t{block.height});
  const std::uint64_t row_bytes = unpacked_bytes(*layer.source, design_.mosaic.sources().type) /
                                  static_cast<std::uint64_t>(std::max<std::int64_t>(1, layer.source->height()));
  return rows * row_bytes > options_.memory_bytes / 4;
}

Result<void> BuildRun::spool_sources() {
  const auto& layers = design_.mosaic.layers();
  const TexelType& type = design_.mosaic.sources().type;
  for (std::size_t i = 0; i < layers.size(); ++i) {
    if (!must_be_spooled(layers[i])) continue;
    workspace_->keep();
    if (const auto ok = require_space(workspace_->file(""), unpacked_bytes(*layers[i].source, type),
                                      layers[i].source->label() + ", unpacked,");
        !ok)
      return ok;
    auto spooled = SpooledSource::make(layers[i].source, type, workspace_->file(fmt::format("source{}", i)),
                                       options_.memory_bytes / 4, options_.show_progress);
    if (!spooled) return fail(spooled);
    design_.mosaic.replace_source(i, std::move(*spooled));
  }
  return {};
}

Result<void> BuildRun::run_stages() {
  const TileSink sink = [this](const ChunkRecord& record, std::span<const std::byte> tiles) {
    return store(record, tiles);
  };
  const int stages = options_.shard ? 1 : static_cast<int>(plan_.stages().size());
  for (int stage = 0; stage < stages; ++stage) {
    std::vector<Chunk> chunks = engine_.chunks(stage, stage > 0 || depth_first_ || options_.shard);
    if (stage == 0) chunks = own_part(std::move(chunks));
    std::int64_t tiles = 0;
    for (const Chunk& chunk : chunks) tiles += engine_.tiles_in(stage, chunk);
    tiles_to_pack_ = std::max(tiles_to_pack_, tiles);
    Progress progress(
        stage == 0 ? "building"
                   : fmt::format("building levels from {} on", plan_.stages()[static_cast<std::size_t>(stage)].first),
        "tiles", std::max<std::int64_t>(1, tiles), options_.show_progress);
    if (const auto ok = engine_.run(stage, chunks, workers_, sink, progress); !ok) return ok;
    workspace_->keep();
  }
  return {};
}

Result<void> BuildRun::make_tiles() {
  if (const auto ok = open_workspaces(); !ok) return ok;
  auto done = options_.join > 0 ? Result<void>() : spool_sources();
  if (done) done = run_stages();
  if (done) return done;
  const auto kept = workspace_->journal().appended() + kept_chunks_;
  if (kept == 0) return done;
  workspace_->keep();
  return fail(done.error().kind, fmt::format("{}; what is done is kept in {}: the same command goes on from there",
                                             done.error().message, folder().string()));
}

Result<fs::path> BuildRun::put_together() {
  const auto image = describe_file(design_, options_, packer_, plan_.sizes(), &engine_.statistics());
  if (!image) return fail(image);
  if (!in_place_) {
    auto arrangement = arrange(table_.sizes());
    if (!arrangement) return fail(arrangement);
    arrangement_ = std::move(*arrangement);
    if (const auto ok = require_space(workspace_->file(""), arrangement_.file_bytes, "putting tiles in order"); !ok)
      return fail(ok);
    std::error_code error;
    fs::remove(workspace_->file("map.tif"), error);
    auto map = DiskFile::open(workspace_->file("map.tif"));
    if (!map) return fail(map);
    map_ = std::move(*map);
    std::vector<const DiskFile*> spools;
    for (const auto& shard : shards_) spools.push_back(&shard->spool());
    spools.push_back(&workspace_->spool());
    std::int64_t tiles = 0;
    for (const auto& level : arrangement_.imagery) tiles += static_cast<std::int64_t>(level.size());
    Progress progress("putting in order", "tiles", tiles, options_.show_progress);
    if (const auto ok = gather_tiles(*map_, arrangement_, table_, spools, threads_of(options_), progress); !ok)
      return fail(ok);
  }
  if (const auto ok = write_frame(*map_, *image, arrangement_, table_); !ok) return fail(ok);
  return workspace_->file("map.tif");
}

void BuildRun::clean_up() {
  workspace_->discard();
  for (const auto& shard : shards_) shard->discard();
}

void BuildRun::fill(BuildReport& report) const {
  report.levels = plan_.sizes();
  report.bands = design_.mosaic.type().bands;
  report.sample_type = name_of(design_.mosaic.type().sample);
  report.reduction = describe(design_.reduction);
  report.raw_bytes = raw_bytes();
  report.kept_chunks = kept_chunks_;
  for (std::size_t level = 0; level < plan_.sizes().size(); ++level) {
    const auto& sizes = table_.sizes()[level].imagery;
    report.tiles += static_cast<std::int64_t>(sizes.size());
    report.empty_tiles += std::count(sizes.begin(), sizes.end(), 0u);
  }
  for (const mosaic::Layer& layer : design_.mosaic.layers()) {
    if (layer.source->blocks_decoded() == 0) continue;
    report.source_blocks += layer.source->blocks();
    report.blocks_decoded += layer.source->blocks_decoded();
  }
  report.plan = explain();
  report.warnings = design_.warnings;
}

}  // namespace nadir::pyramid
