#include "check_structure.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <string_view>

#include "nadir/tiff/cog.h"

namespace nadir::pyramid {
namespace {

using tiff::Directory, tiff::TiffFile, tiff::TilePlace;

/// A packed tile in the file.
struct Extent {
  std::uint64_t offset = 0, size = 0;
  std::uint32_t directory = 0;
  std::uint64_t tile = 0;  // row by row, plane by plane
};

class Structure {
 public:
  Structure(const TiffFile& file, CheckReport& report, FaultList& faults)
      : file_(file), report_(report), faults_(faults) {}

  std::vector<std::uint32_t> check() {
    report_.cloud_optimized = file_.cloud_optimized();
    find_levels();
    check_sizes();
    for (std::size_t k = 0; k < levels_.size(); ++k) {
      locate_tiles(levels_[k].image, static_cast<int>(k));
      if (levels_[k].mask) locate_tiles(*levels_[k].mask, static_cast<int>(k));
      check_losses(static_cast<int>(k));
    }
    check_overlaps();
    check_order();
    check_surroundings();
    std::vector<std::uint32_t> directories;
    for (const Level& level : levels_) directories.push_back(level.image);
    return directories;
  }

 private:
  struct Level {
    std::uint32_t image = 0;
    std::optional<std::uint32_t> mask;
    std::uint64_t first = ~std::uint64_t{0}, end = 0;  // bytes of its tiles
  };

  const Directory& directory(std::uint32_t index) const { return file_.directories()[index]; }

  void find_levels() {
    const auto& all = file_.directories();
    for (std::uint32_t i = 0; i < all.size(); ++i)
      if (!all[i].mask && (i == 0 || all[i].reduced)) levels_.push_back({i, {}});
    for (std::uint32_t i = 0; i < all.size(); ++i) {
      if (!all[i].mask) continue;
      const auto of = std::find_if(levels_.begin(), levels_.end(), [&](const Level& level) {
        const Directory& image = directory(level.image);
        return !level.mask && image.width == all[i].width && image.height == all[i].height;
      });
      if (of == levels_.end())
        faults_.add(
            fmt::format("directory {}: a mask of {} x {} texels belongs to no level", i, all[i].width, all[i].height));
      else
        of->mask = i;
    }
    report_.levels.resize(levels_.size());
    for (std::size_t k = 0; k < levels_.size(); ++k) {
      const Directory& image = directory(levels_[k].image);
      report_.levels[k].size = {static_cast<std::int32_t>(image.width), static_cast<std::int32_t>(image.height)};
      if (levels_[k].mask.has_value() != levels_[0].mask.has_value())
        faults_.add(
            static_cast<int>(k), 0, 0,
            fmt::format("level {}: {} a mask, unlike level 0: build it again", k, levels_[k].mask ? "has" : "lacks"));
    }
  }

  void check_sizes() {
    for (std::size_t k = 1; k < levels_.size(); ++k) {
      const Directory &fine = directory(levels_[k - 1].image), &coarse = directory(levels_[k].image);
      const auto halved = [](std::uint32_t f, std::uint32_t c) { return c == std::max(1u, f / 2) || c == f - f / 2; };
      if (!halved(fine.width, coarse.width) || !halved(fine.height, coarse.height))
        report_.notes.push_back(
            fmt::format("level {} of {} x {} texels is not half of level {}", k, coarse.width, coarse.height, k - 1));
    }
    const Directory& last = directory(levels_.back().image);
    if (last.width > 2 * last.format.tile_width || last.height > 2 * last.format.tile_height)
      report_.notes.push_back(
          fmt::format("the coarsest level has {} x {} texels: views from far above read all of it; `nadir build` makes "
                      "the levels that are missing",
                      last.width, last.height));
  }

  void locate_tiles(std::uint32_t index, int level) {
    constexpr std::uint64_t at_once = 4096;
    const Directory& image = directory(index);
    const std::uint32_t planes = image.format.separate ? image.format.samples : 1;
    const std::uint64_t a_plane = image.tiles_a_plane(), count = a_plane * planes;
    LevelCheck& found = report_.levels[static_cast<std::size_t>(level)];
    if (!image.mask) found.tiles = static_cast<std::int64_t>(count);
    std::vector<tiff::TileAddress> addresses;
    for (std::uint64_t begin = 0; begin < count; begin += at_once) {
      addresses.clear();
      for (std::uint64_t i = begin; i < std::min(count, begin + at_once); ++i)
        addresses.push_back({index, static_cast<std::uint32_t>(i / a_plane),
                             static_cast<std::uint32_t>(i % a_plane % image.tiles_across()),
                             static_cast<std::uint32_t>(i % a_plane / image.tiles_across())});
      const auto places = file_.locate(addresses);
      for (std::size_t i = 0; i < places.size(); ++i) {
        if (!places[i]) {
          faults_.add(level, addresses[i].row, addresses[i].col,
                      fmt::format("{}: {}", name(index, begin + i), places[i].error().message));
          continue;
        }
        if (places[i]->size == 0) {
          found.empty_tiles += image.mask ? 0 : 1;
          continue;
        }
        found.bytes += places[i]->size;
        extents_.push_back({places[i]->offset, places[i]->size, index, begin + i});
        Level& of = levels_[static_cast<std::size_t>(level)];
        of.first = std::min(of.first, places[i]->offset);
        of.end = std::max(of.end, places[i]->offset + places[i]->size);
      }
    }
  }

  /// "level 2, tile (3, 5)" of column and row.
  std::string name(std::uint32_t index, std::uint64_t tile) const {
    const Directory& image = directory(index);
    std::size_t level = 0;
    while (level + 1 < levels_.size() && levels_[level].image != index && levels_[level].mask != index) ++level;
    const std::uint64_t in_plane = tile % image.tiles_a_plane();
    return fmt::format("level {}, {} ({}, {})", level, image.mask ? "mask of tile" : "tile",
                       in_plane % image.tiles_across(), in_plane / image.tiles_across());
  }

  void check_losses(int level) {
    const Directory& image = directory(levels_[static_cast<std::size_t>(level)].image);
    const tiff::Field* field = image.field(tiff::tag::tile_losses);
    if (!field) return;
    const auto place = file_.numbers(*field);
    const auto bytes = [&] { return (*place)[1] * sizeof(float); };
    if (!place || place->size() != 2 || (*place)[0] + bytes() > static_cast<double>(file_.source().size()) ||
        static_cast<std::uint64_t>((*place)[1]) % image.tiles_a_plane() != 0) {
      faults_.add(level, 0, 0, fmt::format("level {}: losses of tiles do not lie in the file: build it again", level));
      return;
    }
    constexpr std::size_t at_once = 1 << 16;
    std::vector<float> losses;
    const auto count = static_cast<std::uint64_t>((*place)[1]);
    for (std::uint64_t begin = 0; begin < count; begin += at_once) {
      losses.resize(static_cast<std::size_t>(std::min<std::uint64_t>(at_once, count - begin)));
      const auto read = file_.source().read(static_cast<std::uint64_t>((*place)[0]) + begin * sizeof(float),
                                            std::as_writable_bytes(std::span(losses)));
      const bool sound = read && std::all_of(losses.begin(), losses.end(),
                                             [](float loss) { return std::isfinite(loss) && loss >= 0; });
      if (sound) continue;
      faults_.add(level, 0, 0, fmt::format("level {}: losses of tiles are no losses: build it again", level));
      return;
    }
  }

  void check_overlaps() {
    std::sort(extents_.begin(), extents_.end(), [](const Extent& a, const Extent& b) { return a.offset < b.offset; });
    for (std::size_t i = 1; i < extents_.size(); ++i) {
      const Extent &a = extents_[i - 1], &b = extents_[i];
      const bool same = a.offset == b.offset && a.size == b.size;  // some writers store equal tiles once
      if (!same && a.offset + a.size > b.offset)
        faults_.add(fmt::format("{} and {} overlap in the file, at byte {}: build it again", name(a.directory, a.tile),
                                name(b.directory, b.tile), b.offset));
    }
  }

  void check_order() {
    if (!report_.cloud_optimized) {
      report_.notes.push_back("not laid out as a cloud-optimized GeoTIFF");
      return;
    }
    for (std::size_t k = 1; k < levels_.size(); ++k)
      if (levels_[k].end > 0 && levels_[k - 1].end > 0 && levels_[k].end > levels_[k - 1].first)
        faults_.add(static_cast<int>(k), 0, 0,
                    fmt::format("level {} does not lie before level {} in the file, as its notes promise: copy it with "
                                "gdal_translate -of COG",
                                k, k - 1));
  }

  /// Leader and trailer of each tile, where the notes at the file's begin promise them.
  void check_surroundings() {
    std::array<std::byte, 1024> head{};
    const std::uint64_t size = file_.source().size();
    if (!report_.cloud_optimized ||
        !file_.source().read(0, std::span(head).first(std::min<std::uint64_t>(size, head.size()))))
      return;
    const std::string_view notes(reinterpret_cast<const char*>(head.data()), head.size());
    if (notes.find("BLOCK_LEADER=SIZE_AS_UINT4") == std::string_view::npos ||
        notes.find("BLOCK_TRAILER=LAST_4_BYTES_REPEATED") == std::string_view::npos)
      return;
    for (const Extent& tile : extents_)
      if (!is_surrounded(tile))
        faults_.add(
            fmt::format("{}: what lies before and behind its {} bytes at {} does not fit it: something was "
                        "overwritten; build it again",
                        name(tile.directory, tile.tile), tile.size, tile.offset));
  }

  bool is_surrounded(const Extent& tile) const {
    constexpr std::uint64_t around = 4;
    std::uint32_t leader = 0;
    std::array<std::byte, 2 * around> end{};
    const std::uint64_t last = std::min(tile.size, around);
    if (tile.offset < around ||
        !file_.source().read(tile.offset - around, std::as_writable_bytes(std::span(&leader, 1))) ||
        !file_.source().read(tile.offset + tile.size - last, std::span(end).first(last + around)))
      return false;
    // Of a tile with fewer bytes the trailer begins with others
    return leader == tile.size && std::memcmp(end.data(), end.data() + last + around - last, last) == 0;
  }

  const TiffFile& file_;
  CheckReport& report_;
  FaultList& faults_;
  std::vector<Level> levels_;
  std::vector<Extent> extents_;
};

}  // namespace

std::vector<std::uint32_t> check_structure(const TiffFile& file, CheckReport& report, FaultList& faults) {
  return Structure(file, report, faults).check();
}

}  // namespace nadir::pyramid
