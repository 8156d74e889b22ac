#include "spooled_source.h"

#include <algorithm>

#include "nadir/base/progress.h"

namespace nadir::pyramid {

using mosaic::Block;
using mosaic::Window;

SpooledSource::SpooledSource(std::shared_ptr<const Source> source, const mosaic::TexelType& type)
    : source_(std::move(source)), type_(type) {
  description_ = source_->description();
}

std::uint64_t SpooledSource::row_bytes() const {
  return static_cast<std::uint64_t>(width()) * (type_.texel_bytes() + (type_.mask ? 1 : 0));
}

Result<std::shared_ptr<const mosaic::Source>> SpooledSource::make(std::shared_ptr<const Source> source,
                                                                  const mosaic::TexelType& type,
                                                                  const std::filesystem::path& file,
                                                                  std::uint64_t bytes, bool show_progress) {
  std::shared_ptr<SpooledSource> spooled(new SpooledSource(std::move(source), type));
  std::error_code error;
  if (!std::filesystem::exists(file, error)) {
    std::filesystem::path part = file;
    part += ".part";
    auto unfinished = DiskFile::open(part);
    if (!unfinished) return fail(unfinished);
    if (const auto ok = spooled->unpack(*unfinished, bytes, show_progress); !ok) return fail(ok);
    std::filesystem::rename(part, file, error);
    if (error) return fail(Error::Kind::Io, part.string() + ": cannot be renamed: " + error.message());
  }
  auto whole = DiskFile::open(file);
  if (!whole) return fail(whole);
  spooled->file_ = std::move(*whole);
  return std::shared_ptr<const Source>(std::move(spooled));
}

Result<void> SpooledSource::unpack(const DiskFile& file, std::uint64_t bytes, bool show_progress) const {
  const std::int64_t strip = std::max<std::int64_t>(1, block().height);
  const auto strips = std::max<std::int64_t>(1, static_cast<std::int64_t>(bytes / row_bytes()) / strip);
  Progress progress("unpacking " + label(), "rows", height(), show_progress);
  Block rows;
  for (std::int64_t y = 0; y < height(); y += strips * strip) {
    const Window window{0, static_cast<std::int32_t>(y), static_cast<std::int32_t>(width()),
                        static_cast<std::int32_t>(std::min(strips * strip, height() - y))};
    rows.reset(type_, window);
    if (const auto ok = source_->read(rows); !ok) return ok;
    for (std::int32_t row = window.y; row < window.y + window.height; ++row) {
      const std::uint64_t at = static_cast<std::uint64_t>(row) * row_bytes();
      if (const auto ok = file.write(at, {rows.row(row), rows.row_bytes()}); !ok) return ok;
      if (!type_.mask) continue;
      const auto* valid = reinterpret_cast<const std::byte*>(rows.valid_row(row));
      if (const auto ok = file.write(at + rows.row_bytes(), {valid, static_cast<std::size_t>(width())}); !ok) return ok;
    }
    progress.advance(window.height);
  }
  return {};
}

Result<void> SpooledSource::read(Block& to) const {
  const Window& w = to.window();
  const std::size_t texel = type_.texel_bytes();
  for (std::int32_t y = w.y; y < w.y + w.height; ++y) {
    const std::uint64_t row = static_cast<std::uint64_t>(y) * row_bytes(), x = static_cast<std::uint64_t>(w.x);
    if (const auto ok = file_.read(row + x * texel, {to.row(y), to.row_bytes()}); !ok) return ok;
    if (!type_.mask) continue;
    const std::uint64_t validity = row + static_cast<std::uint64_t>(width()) * texel;
    auto* valid = reinterpret_cast<std::byte*>(to.valid_row(y));
    if (const auto ok = file_.read(validity + x, {valid, static_cast<std::size_t>(w.width)}); !ok) return ok;
  }
  return {};
}

}  // namespace nadir::pyramid
