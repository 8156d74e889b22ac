#include "raw_level.h"

#include <algorithm>
#include <cstring>

#include "nadir/base/raw_bytes.h"

namespace nadir::pyramid {
namespace {

std::uint64_t key_of(std::int32_t col, std::int32_t row) {
  return static_cast<std::uint64_t>(row) << 32 | static_cast<std::uint32_t>(col);
}

}  // namespace

Result<std::uint32_t> RawLevel::add_file(DiskFile file) {
  const auto size = file.size();
  if (!size) return fail(size);
  end_ = *size;
  files_.push_back(std::move(file));
  return static_cast<std::uint32_t>(files_.size() - 1);
}

std::uint64_t RawLevel::tile_bytes(std::int32_t col, std::int32_t row) const {
  const Window w = plan_.window_of(level_, {col, row, 1, 1});
  return static_cast<std::uint64_t>(w.width) * static_cast<std::uint64_t>(w.height) *
         (type_.texel_bytes() + (type_.mask ? 1 : 0));
}

Result<std::uint64_t> RawLevel::store(const Block& block, std::int32_t col, std::int32_t row) {
  const Window w = plan_.window_of(level_, {col, row, 1, 1});
  static thread_local RawBytes bytes;
  bytes.resize(tile_bytes(col, row));
  const auto width = static_cast<std::size_t>(w.width), height = static_cast<std::size_t>(w.height);
  const auto skipped = static_cast<std::size_t>(w.x - block.window().x);
  const std::size_t row_bytes = width * type_.texel_bytes();
  for (std::size_t y = 0; y < height; ++y) {
    const std::int32_t at = w.y + static_cast<std::int32_t>(y);
    std::memcpy(bytes.data() + y * row_bytes, block.row(at) + skipped * type_.texel_bytes(), row_bytes);
    if (type_.mask) std::memcpy(bytes.data() + height * row_bytes + y * width, block.valid_row(at) + skipped, width);
  }
  const std::uint64_t offset = end_.fetch_add(bytes.size());
  if (const auto ok = files_.back().write(offset, bytes); !ok) return fail(ok);
  return offset;
}

bool RawLevel::add(std::int32_t col, std::int32_t row, std::uint32_t file, std::uint64_t offset,
                   std::vector<BandStatistics> statistics) {
  const auto size = files_[file].size();
  const std::uint64_t bytes = tile_bytes(col, row);
  if (!size || offset > *size || bytes > *size - offset) return false;
  std::scoped_lock lock(mutex_);
  tiles_[key_of(col, row)] = {file, offset, std::move(statistics)};
  return true;
}

const RawLevel::Tile* RawLevel::find(std::int32_t col, std::int32_t row) const {
  std::scoped_lock lock(mutex_);
  const auto found = tiles_.find(key_of(col, row));
  return found == tiles_.end() ? nullptr : &found->second;
}

TileRange RawLevel::tiles_under(const Window& w) const {
  const std::int32_t side = plan_.tile_size();
  TileRange range{w.x / side, w.y / side, 0, 0};
  range.cols = (w.x + w.width - 1) / side + 1 - range.col;
  range.rows = (w.y + w.height - 1) / side + 1 - range.row;
  return range;
}

bool RawLevel::reaches(const Window& window) const {
  const TileRange range = tiles_under(window);
  for (std::int32_t row = range.row; row < range.row + range.rows; ++row)
    for (std::int32_t col = range.col; col < range.col + range.cols; ++col)
      if (find(col, row)) return true;
  return false;
}

Result<void> RawLevel::read(Block& to) const {
  const TileRange range = tiles_under(to.window());
  std::vector<std::pair<const Tile*, Window>> tiles;
  for (std::int32_t row = range.row; row < range.row + range.rows; ++row)
    for (std::int32_t col = range.col; col < range.col + range.cols; ++col)
      if (const Tile* tile = find(col, row)) tiles.emplace_back(tile, plan_.window_of(level_, {col, row, 1, 1}));
  if (static_cast<std::int64_t>(tiles.size()) < range.count()) clear(type_, to);
  for (const auto& [tile, window] : tiles)
    if (const auto ok = read_tile(*tile, window, to); !ok) return ok;
  return {};
}

Result<void> RawLevel::read_tile(const Tile& tile, const Window& w, Block& to) const {
  const DiskFile& file = files_[tile.file];
  const std::int32_t left = std::max(w.x, to.window().x), top = std::max(w.y, to.window().y);
  const std::int32_t right = std::min(w.x + w.width, to.window().x + to.window().width);
  const std::int32_t bottom = std::min(w.y + w.height, to.window().y + to.window().height);
  const auto texels = static_cast<std::size_t>(right - left), rows = static_cast<std::size_t>(bottom - top);
  const auto tile_width = static_cast<std::size_t>(w.width);
  const auto skipped = static_cast<std::size_t>(top - w.y) * tile_width + static_cast<std::size_t>(left - w.x);

  // Samples, then validity: planes of the same shape with texels of other sizes.
  const auto read_plane = [&](std::uint64_t begin, std::byte* first, std::size_t texel,
                              std::size_t stride) -> Result<void> {
    const std::uint64_t offset = begin + skipped * texel;
    if (texels == tile_width) return file.read_rows(offset, first, texels * texel, stride, rows);
    for (std::size_t y = 0; y < rows; ++y)
      if (const auto ok = file.read(offset + y * tile_width * texel, {first + y * stride, texels * texel}); !ok)
        return ok;
    return {};
  };
  const auto column = static_cast<std::size_t>(left - to.window().x);
  const std::size_t texel = type_.texel_bytes();
  if (const auto ok = read_plane(tile.offset, to.row(top) + column * texel, texel, to.row_bytes()); !ok) return ok;
  if (!type_.mask) return {};
  return read_plane(tile.offset + tile_width * static_cast<std::size_t>(w.height) * texel,
                    reinterpret_cast<std::byte*>(to.valid_row(top) + column), 1,
                    static_cast<std::size_t>(to.window().width));
}

const std::vector<BandStatistics>* RawLevel::statistics(std::int32_t col, std::int32_t row) const {
  const Tile* tile = find(col, row);
  return tile ? &tile->statistics : nullptr;
}

}  // namespace nadir::pyramid
