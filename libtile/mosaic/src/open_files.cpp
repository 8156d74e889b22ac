#include "open_files.h"

#include <cpl_conv.h>
#include <fmt/format.h>
#include <sys/stat.h>

namespace nadir::mosaic {

SourceFile SourceFile::look_at(std::string path, std::string label) {
  SourceFile file{std::move(path), std::move(label)};
  struct stat status = {};
  if (::stat(file.path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return file;
  file.on_disk = true;
  file.bytes = static_cast<std::uint64_t>(status.st_size);
  file.changed_ns = std::int64_t{status.st_mtim.tv_sec} * 1'000'000'000 + status.st_mtim.tv_nsec;
  return file;
}

Result<void> SourceFile::check_unchanged() const {
  if (!on_disk) return {};
  const SourceFile now = look_at(path, {});
  if (now.on_disk && now.bytes == bytes && now.changed_ns == changed_ns) return {};
  return fail(Error::Kind::Io,
              fmt::format("{}: {} since its headers were read; leave sources alone until the map is built, and start "
                          "again",
                          label, now.on_disk ? "has changed" : "has gone"));
}

Result<gdal::Dataset> open_dataset(const std::string& path) {
  constexpr const char* option = "GDAL_DISABLE_READDIR_ON_OPEN";
  const bool decided =
      CPLGetConfigOption(option, nullptr) || path.starts_with("/vsi");  // by the user, or by open_raster
  if (!decided) CPLSetThreadLocalConfigOption(option, "TRUE");
  auto dataset = gdal::open_raster(path);
  if (!decided) CPLSetThreadLocalConfigOption(option, nullptr);
  return dataset;
}

Result<std::shared_ptr<const tiff::TiffFile>> OpenTiffs::get(const SourceFile& file) {
  if (auto ok = file.check_unchanged(); !ok) return fail(ok);
  {
    const std::scoped_lock lock(mutex_);
    if (const auto it = by_path_.find(file.path); it != by_path_.end()) {
      used_.splice(used_.begin(), used_, it->second);
      return it->second->second;
    }
  }
  auto bytes = LocalFile::open(file.path);
  if (!bytes) return fail(bytes);
  auto opened = tiff::TiffFile::open(std::move(*bytes));
  if (!opened) return opened;

  std::shared_ptr<const tiff::TiffFile> oldest;  // closed once unlocked
  const std::scoped_lock lock(mutex_);
  if (by_path_.contains(file.path)) return opened;
  used_.emplace_front(file.path, *opened);
  by_path_[file.path] = used_.begin();
  if (used_.size() > most_) {
    oldest = std::move(used_.back().second);
    by_path_.erase(used_.back().first);
    used_.pop_back();
  }
  return opened;
}

Result<gdal::Dataset> OpenDatasets::borrow(const SourceFile& file, std::int64_t row) {
  if (auto ok = file.check_unchanged(); !ok) return fail(ok);
  {
    const std::scoped_lock lock(mutex_);
    auto best = idle_.end();
    for (auto it = idle_.begin(); it != idle_.end(); ++it) {
      if (it->path != file.path) continue;
      const auto rank = [&](const Idle& idle) { return idle.row <= row ? idle.row : std::int64_t{-1}; };
      if (best == idle_.end() || rank(*it) > rank(*best)) best = it;
    }
    if (best != idle_.end()) {
      gdal::Dataset dataset = std::move(best->dataset);
      idle_.erase(best);
      return dataset;
    }
  }
  return open_dataset(file.path);
}

void OpenDatasets::give_back(const SourceFile& file, std::int64_t row, gdal::Dataset dataset) {
  gdal::Dataset oldest;  // closed once unlocked
  const std::scoped_lock lock(mutex_);
  idle_.push_front({file.path, row, std::move(dataset)});
  if (idle_.size() <= most_idle_) return;
  oldest = std::move(idle_.back().dataset);
  idle_.pop_back();
}

}  // namespace nadir::mosaic
