#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "tiff_rows.h"

namespace nadir::mosaic {
namespace {

/// What is read at once on its way through memory: it is still in the nearest caches when it is laid out.
constexpr std::size_t bytes_at_once = 256 << 10;

/// A thread's memory for rows on their way.
std::byte* of_thread(std::size_t bytes) {
  static thread_local std::vector<std::byte> memory;
  if (memory.size() < bytes) memory.resize(bytes);
  return memory.data();
}

/// A TIFF whose rows lie in the file as they are handed out.
class PlainTiff : public Source {
 public:
  PlainTiff(const RasterHeader& header, const Reading& reading, std::shared_ptr<Shared> shared)
      : file_(header.file),
        layout_(*header.tiff),
        rows_(rows_of(header, reading)),
        conversion_(rows_.rule),
        shared_(std::move(shared)) {
    description_ = header.description;
  }

  std::int64_t width() const override { return layout_.image_directory.width; }
  std::int64_t height() const override { return layout_.image_directory.height; }
  bool plain() const override { return true; }
  std::int64_t blocks_decoded() const override { return 0; }

  Window block() const override {
    const tiff::TileFormat& format = layout_.image_directory.format;
    return {0, 0, static_cast<std::int32_t>(std::min(format.tile_width, layout_.image_directory.width)),
            static_cast<std::int32_t>(std::min(format.tile_height, layout_.image_directory.height))};
  }
  std::int64_t blocks() const override { return static_cast<std::int64_t>(layout_.image_directory.tiles_a_plane()); }

  Result<void> read(Block& to) const override {
    const auto tiff = shared_->tiffs.get(file_);
    if (!tiff) return fail(tiff);
    const Window& w = to.window();
    if (conversion_.copies() && rows_.planes.size() == 1) {
      for (std::int32_t y = w.y; y < w.y + w.height && to.masked(); ++y)
        std::memset(to.valid_row(y), 255, static_cast<std::size_t>(w.width));
      return read_plane(**tiff, 0, w, to.row(w.y), to.row_bytes());
    }
    return read_converted(**tiff, to);
  }

 private:
  Result<void> read_converted(const tiff::TiffFile& tiff, Block& to) const;
  /// `plane`: index among those that are read.
  Result<void> read_plane(const tiff::TiffFile& tiff, std::size_t plane, const Window& window, std::byte* out,
                          std::size_t stride) const;
  Result<void> read_part(const tiff::TiffFile& tiff, const tiff::TilePlace& place, const Window& tile,
                         const Window& part, const std::byte* missing, std::byte* out, std::size_t stride) const;
  tl::unexpected<Error> damaged(const Window& part, const std::string& cause) const {
    return fail(Error::Kind::Damaged,
                fmt::format("{}: texels {} to {} by {} to {} cannot be read: {}; fetch or build the file again",
                            label(), part.x, part.x + part.width, part.y, part.y + part.height, cause));
  }
  std::size_t texel_bytes() const { return rows_.missing.size() / rows_.planes.size(); }  // of a plane

  const SourceFile file_;
  const TiffLayout layout_;
  const TiffRows rows_;
  const Conversion conversion_;
  const std::shared_ptr<Shared> shared_;
};

/// Some rows at a time.
Result<void> PlainTiff::read_converted(const tiff::TiffFile& tiff, Block& to) const {
  const Window& w = to.window();
  const std::size_t texels = static_cast<std::size_t>(w.width), stored_texel = rows_.missing.size(),
                    planes = rows_.planes.size();
  const std::size_t row_bytes = (texels * stored_texel + 7) / 8 * 8;
  const auto rows_at_once = static_cast<std::int32_t>(std::clamp<std::size_t>(bytes_at_once / row_bytes, 1, 1 << 16));
  std::vector<std::byte> staged(row_bytes * static_cast<std::size_t>(std::min(rows_at_once, w.height)));
  std::vector<std::byte> apart(planes > 1 ? staged.size() : 0);
  for (std::int32_t y = w.y; y < w.y + w.height; y += rows_at_once) {
    const Window some{w.x, y, w.width, std::min(rows_at_once, w.y + w.height - y)};
    for (std::size_t p = 0; p < planes; ++p) {
      std::byte* out = planes > 1 ? apart.data() : staged.data();
      if (auto ok = read_plane(tiff, p, some, out, row_bytes); !ok) return ok;
      if (planes == 1) continue;
      tiff::with_sample(rows_.rule.stored, [&]<class T>(T) {
        for (std::size_t line = 0; line < static_cast<std::size_t>(some.height); ++line) {
          const T* from = reinterpret_cast<const T*>(out + line * row_bytes);
          T* into = reinterpret_cast<T*>(staged.data() + line * row_bytes) + p;
          for (std::size_t x = 0; x < texels; ++x) into[x * planes] = from[x];
        }
      });
    }
    for (std::int32_t line = 0; line < some.height; ++line)
      conversion_.row(staged.data() + static_cast<std::size_t>(line) * row_bytes, nullptr, texels, to.row(y + line),
                      to.masked() ? to.valid_row(y + line) : nullptr);
  }
  return {};
}

Result<void> PlainTiff::read_plane(const tiff::TiffFile& tiff, std::size_t plane, const Window& window, std::byte* out,
                                   std::size_t stride) const {
  const tiff::Directory& image = layout_.image_directory;
  const auto tile_width = static_cast<std::int64_t>(image.format.tile_width),
             tile_height = static_cast<std::int64_t>(image.format.tile_height);
  const std::int64_t right = window.x + std::int64_t{window.width}, bottom = window.y + std::int64_t{window.height};
  std::vector<tiff::TileAddress> tiles;
  for (std::int64_t row = window.y / tile_height; row * tile_height < bottom; ++row)
    for (std::int64_t col = window.x / tile_width; col * tile_width < right; ++col)
      tiles.push_back(
          {layout_.image, rows_.planes[plane], static_cast<std::uint32_t>(col), static_cast<std::uint32_t>(row)});
  const auto places = tiff.locate(tiles);

  const std::byte* missing = rows_.missing.data() + plane * texel_bytes();

  // Strips that follow one another in the file, as they do in memory, are read at once
  struct {
    std::uint64_t offset = 0;
    std::byte* out = nullptr;
    std::size_t bytes = 0;
  } run;
  const auto read_run = [&]() -> Result<void> {
    if (run.bytes == 0) return {};
    auto ok = tiff.source().read(run.offset, {run.out, run.bytes});
    run.bytes = 0;
    return ok;
  };
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const std::int64_t x = tiles[i].col * tile_width, y = tiles[i].row * tile_height;
    const Window tile{static_cast<std::int32_t>(x), static_cast<std::int32_t>(y), static_cast<std::int32_t>(tile_width),
                      static_cast<std::int32_t>(std::min<std::int64_t>(tile_height, image.height - y))};
    Window part{std::max(window.x, tile.x), std::max(window.y, tile.y), 0, 0};
    part.width = static_cast<std::int32_t>(std::min(right, x + tile_width) - part.x);
    part.height = static_cast<std::int32_t>(std::min(bottom, y + tile.height) - part.y);
    if (!places[i])
      return places[i].error().kind == Error::Kind::Damaged ? damaged(part, places[i].error().message)
                                                            : fail(places[i]);
    std::byte* to = out + static_cast<std::size_t>(part.y - window.y) * stride +
                    static_cast<std::size_t>(part.x - window.x) * texel_bytes();
    const std::uint64_t row_bytes = image.format.row_bytes(), skipped = static_cast<std::uint64_t>(part.y - tile.y),
                        bytes = row_bytes * static_cast<std::uint64_t>(part.height);
    const bool whole_rows = part.width == tile.width && stride == row_bytes;
    if (whole_rows && places[i]->size >= row_bytes * skipped + bytes) {
      const std::uint64_t offset = places[i]->offset + row_bytes * skipped;
      if (run.bytes == 0 || offset != run.offset + run.bytes || to != run.out + run.bytes) {
        if (auto ok = read_run(); !ok) return ok;
        run = {offset, to, 0};
      }
      run.bytes += static_cast<std::size_t>(bytes);
      continue;
    }
    if (auto ok = read_part(tiff, *places[i], tile, part, missing, to, stride); !ok) return ok;
  }
  return read_run();
}

Result<void> PlainTiff::read_part(const tiff::TiffFile& tiff, const tiff::TilePlace& place, const Window& tile,
                                  const Window& part, const std::byte* missing, std::byte* out,
                                  std::size_t stride) const {
  const std::size_t texel = texel_bytes(), part_bytes = static_cast<std::size_t>(part.width) * texel;
  if (place.size == 0) {  // never written
    for (std::int32_t line = 0; line < part.height; ++line)
      for (std::size_t x = 0; x < static_cast<std::size_t>(part.width); ++x)
        std::memcpy(out + static_cast<std::size_t>(line) * stride + x * texel, missing, texel);
    return {};
  }
  const auto row_bytes = static_cast<std::size_t>(layout_.image_directory.format.row_bytes());
  const std::uint64_t rows_needed = static_cast<std::uint64_t>(part.y - tile.y + part.height);
  if (place.size < row_bytes * rows_needed)
    return damaged(part,
                   fmt::format("{} bytes of {}", place.size, row_bytes * static_cast<std::uint64_t>(tile.height)));
  const std::size_t lead = static_cast<std::size_t>(part.x - tile.x) * texel;
  std::uint64_t offset = place.offset + static_cast<std::uint64_t>(part.y - tile.y) * row_bytes + lead;

  // One system call a row costs more than the bytes of short rows that nobody wants.
  constexpr std::size_t bytes_a_call = 4096;
  if (part_bytes >= bytes_a_call || row_bytes > part_bytes + bytes_a_call) {
    for (std::int32_t line = 0; line < part.height; ++line, offset += row_bytes)
      if (auto ok = tiff.source().read(offset, {out + static_cast<std::size_t>(line) * stride, part_bytes}); !ok)
        return ok;
    return {};
  }
  const auto rows_at_once = static_cast<std::int32_t>(std::max<std::size_t>(1, bytes_at_once / row_bytes));
  std::byte* staged = of_thread(static_cast<std::size_t>(std::min(rows_at_once, part.height)) * row_bytes);
  for (std::int32_t first = 0; first < part.height; first += rows_at_once) {
    const auto rows = static_cast<std::size_t>(std::min(rows_at_once, part.height - first));
    const std::size_t bytes = (rows - 1) * row_bytes + part_bytes;
    if (auto ok = tiff.source().read(offset, {staged, bytes}); !ok) return ok;
    for (std::size_t line = 0; line < rows; ++line)
      std::memcpy(out + (static_cast<std::size_t>(first) + line) * stride, staged + line * row_bytes, part_bytes);
    offset += rows * row_bytes;
  }
  return {};
}

}  // namespace

bool is_plain(const RasterHeader& header, const Reading& reading) {
  return header.tiff && !header.tiff->mask && !reading.rule.masked &&
         tiff::rows_lie_as_decoded(header.tiff->image_directory.format);
}

std::shared_ptr<const Source> make_plain_source(const RasterHeader& header, const Reading& reading,
                                                std::shared_ptr<Shared> shared) {
  return std::make_shared<const PlainTiff>(header, reading, std::move(shared));
}

}  // namespace nadir::mosaic
