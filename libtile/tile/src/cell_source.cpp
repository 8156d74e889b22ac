#include "nadir/tile/cell_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>

#include "block_writer.h"
#include "tiff_tiles.h"

namespace nadir::tile {
namespace {

std::uint64_t next_id() {
  static std::atomic<std::uint64_t> counter{1};
  return counter++;
}

std::int32_t cells(std::int32_t texels) { return (texels - 1) / cell_size + 1; }  // up to 2^31 - 1

}  // namespace

class FetchedBlock {
 public:
  explicit FetchedBlock(PackedTile p) : packed(std::move(p)) {}
  const PackedTile packed;
};

CellSource::CellSource(const Map& map, std::vector<int> bands, SampleType type, Domain domain)
    : id_(next_id()),
      map_(map),
      bands_(std::move(bands)),
      stored_(type),
      type_(domain == Domain::Decibel ? SampleType::Float32 : type),
      domain_(domain) {}

Result<std::shared_ptr<const CellSource>> CellSource::make(const Map& map, std::vector<int> bands, Domain domain) {
  if (bands.empty()) bands = map.description().data_bands();
  for (std::size_t i = 0; i < bands.size(); ++i)
    if (std::find(bands.begin(), bands.begin() + static_cast<std::ptrdiff_t>(i), bands[i]) !=
        bands.begin() + static_cast<std::ptrdiff_t>(i))
      return fail(Error::Kind::Malformed,
                  fmt::format("{}: band {} is asked for twice", map.description().path, bands[i]));
  const auto type = map.sample_type(bands);
  if (!type) return fail(type);
  return std::shared_ptr<const CellSource>(new CellSource(map, std::move(bands), *type, domain));
}

std::uint64_t CellSource::cell_bytes() const {
  return cell_area * (bands_.size() * size_bytes(type_) + 1) + sizeof(Cell);
}

CellBlock CellSource::block_of(int level, std::int32_t col, std::int32_t row) const {
  const Level& size = map_.levels()[static_cast<std::size_t>(level)];
  if (!map_.tiles() || size.tile_width % cell_size != 0 || size.tile_height % cell_size != 0)
    return {level, col, row, 1, 1};
  const std::int32_t across = size.tile_width / cell_size, down = size.tile_height / cell_size;
  CellBlock block{level, col / across * across, row / down * down, across, down};
  block.cols = std::min(across, cells(size.width) - block.col);
  block.rows = std::min(down, cells(size.height) - block.row);
  return block;
}

bool CellSource::is_remote() const { return map_.tiles() && map_.tiles()->is_remote(); }

std::vector<Result<std::shared_ptr<const FetchedBlock>>> CellSource::fetch(std::span<const CellBlock> blocks) const {
  std::vector<Result<std::shared_ptr<const FetchedBlock>>> fetched(blocks.size(), nullptr);
  std::vector<TileKey> keys;
  std::vector<std::size_t> of;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const auto tile = tile_of(blocks[i]);
    if (!tile) continue;
    keys.push_back(*tile);
    of.push_back(i);
  }
  if (keys.empty()) return fetched;
  auto tiles = map_.tiles()->fetch(keys, bands_);
  for (std::size_t k = 0; k < keys.size(); ++k) {
    if (tiles[k])
      fetched[of[k]] = std::make_shared<const FetchedBlock>(std::move(*tiles[k]));
    else
      fetched[of[k]] = tl::unexpected(tiles[k].error());
  }
  return fetched;
}

std::optional<TileKey> CellSource::tile_of(const CellBlock& block) const {
  const Level& size = map_.levels()[static_cast<std::size_t>(block.level)];
  if (!map_.tiles() || size.tile_width % cell_size != 0 || size.tile_height % cell_size != 0) return std::nullopt;
  return TileKey{block.level, block.col / (size.tile_width / cell_size), block.row / (size.tile_height / cell_size)};
}

Result<std::vector<std::shared_ptr<Cell>>> CellSource::load(const CellBlock& block,
                                                            std::span<const std::uint8_t> wanted,
                                                            const FetchedBlock* fetched) const {
  const Level& size = map_.levels()[static_cast<std::size_t>(block.level)];
  BlockWriter writer(*this, stored_, block, wanted);
  if (const auto tile = tile_of(block)) {
    std::int64_t texels = 0;
    const auto ok = map_.tiles()->read(
        *tile, bands_, stored_, fetched ? &fetched->packed : nullptr,
        [&](std::uint32_t y, const std::byte* samples, const std::uint8_t* valid, std::uint32_t count) {
          writer.row(y, samples, valid);
          texels += count;
        });
    if (!ok) return fail(ok);
    map_.count_read(texels, bands_.size());
    return writer.take();
  }

  const Window window{block.col * cell_size, block.row * cell_size,
                      std::min(block.cols * cell_size, size.width - block.col * cell_size),
                      std::min(block.rows * cell_size, size.height - block.row * cell_size)};
  const auto texels = map_.read(block.level, window, bands_);
  if (!texels) return fail(texels);
  const std::size_t row_bytes = static_cast<std::size_t>(window.width) * bands_.size() * size_bytes(stored_);
  for (std::uint32_t y = 0; y < static_cast<std::uint32_t>(window.height); ++y)
    writer.row(y, texels->samples.data() + y * row_bytes,
               texels->validity.empty() ? nullptr : texels->validity.data() + std::size_t{y} * window.width);
  return writer.take();
}

std::vector<std::shared_ptr<Cell>> CellSource::damaged(const CellBlock& block, std::span<const std::uint8_t> wanted,
                                                       const std::string& why) const {
  std::vector<std::shared_ptr<Cell>> invalid(block.size());
  for (std::size_t i = 0; i < invalid.size(); ++i) {
    if (!wanted.empty() && !wanted[i]) continue;
    invalid[i] = std::make_shared<Cell>(type_, static_cast<int>(bands_.size()));
    invalid[i]->make_invalid(why);
  }
  return invalid;
}

}  // namespace nadir::tile
