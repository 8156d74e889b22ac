#include "source_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>

#include "nadir/base/files.h"
#include "nadir/base/text.h"
#include "tile_folder.h"

namespace nadir::mosaic {
namespace fs = std::filesystem;
namespace {

constexpr int deepest_list = 8;  // lists that list lists: more is a circle

constexpr std::array<std::string_view, 20> raster_extensions = {
    ".tif",  ".tiff", ".gtiff", ".vrt", ".img", ".jp2", ".j2k", ".png", ".jpg", ".jpeg",
    ".webp", ".asc",  ".bil",   ".bsq", ".dem", ".hgt", ".ecw", ".sid", ".nc",  ".grd"};

std::string lower_extension(const fs::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

bool is_raster(const fs::path& file) {
  const std::string extension = lower_extension(file);
  return std::find(raster_extensions.begin(), raster_extensions.end(), extension) != raster_extensions.end();
}

std::vector<fs::path> sorted(const fs::path& folder, bool (*wanted)(const fs::directory_entry&)) {
  std::vector<fs::path> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (wanted(entry)) found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  return found;
}

std::vector<fs::path> rasters_in(const fs::path& folder) {
  return sorted(folder, [](const fs::directory_entry& entry) {
    std::error_code error;
    return is_raster(entry.path()) && !entry.path().filename().string().starts_with('.') &&
           entry.is_regular_file(error);
  });
}

class SourceList {
 public:
  explicit SourceList(std::optional<int> zoom) : zoom_(zoom) {}

  Result<void> add(const std::string& name, int depth) {
    std::error_code error;
    if (fs::is_directory(name, error)) return add_folder(name);
    if (lower_extension(name) == ".txt" && fs::is_regular_file(name, error)) return add_list(name, depth);
    rasters_.push_back({name, name, nullptr});
    return {};
  }

  std::vector<NamedRaster> take() { return std::move(rasters_); }

 private:
  Result<void> add_folder(const std::string& name) {
    if (holds_tiles(name) || (zoom_ && rasters_in(name).empty())) {
      const auto xml = virtual_raster_of_tiles(name, zoom_);
      if (!xml) return fail(xml);
      auto memory = std::make_shared<const MemoryFile>(*xml);
      rasters_.push_back({memory->path(), name, memory});
      return {};
    }
    std::error_code error;
    if (fs::directory_iterator(name, error); error)
      return fail(Error::Kind::Io, fmt::format("{}: cannot be listed: {}", name, error.message()));
    std::vector<fs::path> files = rasters_in(name);
    if (files.empty())
      for (const fs::path& folder : sorted(name, [](const fs::directory_entry& entry) {
             std::error_code ignored;
             return entry.is_directory(ignored);
           })) {
        const std::vector<fs::path> more = rasters_in(folder);
        files.insert(files.end(), more.begin(), more.end());
      }
    if (files.empty())
      return fail(Error::Kind::NotFound,
                  fmt::format("{}: expected rasters (.tif, .vrt, .jp2, .png, ...) in this folder or in those in it, or "
                              "map tiles {{zoom}}/{{x}}/{{y}}.png, found none",
                              name));
    for (const fs::path& file : files) rasters_.push_back({file.string(), file.string(), nullptr});
    return {};
  }

  Result<void> add_list(const std::string& name, int depth) {
    if (depth == deepest_list)
      return fail(Error::Kind::Malformed, fmt::format("{}: lists that list one another in a circle", name));
    const auto text = read_text_file(name);
    if (!text) return fail(text);
    const std::size_t before = rasters_.size();
    const fs::path folder = fs::path(name).parent_path();
    std::size_t number = 0;
    for (const std::string_view line : split(*text, '\n')) {
      ++number;
      if (line.empty() || line.starts_with('#')) continue;
      const bool placed = line.starts_with("/vsi") || line.find("://") != std::string_view::npos;
      const std::string source = placed ? std::string(line) : (folder / line).string();
      if (auto ok = add(source, depth + 1); !ok) return ok;
      std::error_code error;
      if (!placed && source.find(':') == std::string::npos && !fs::exists(source, error))
        return fail(Error::Kind::NotFound, fmt::format("{}: line {}: {}: no such file", name, number, source));
    }
    if (rasters_.size() == before)
      return fail(Error::Kind::NotFound, fmt::format("{}: expected a list of rasters, one a line, found none", name));
    return {};
  }

  const std::optional<int> zoom_;
  std::vector<NamedRaster> rasters_;
};

}  // namespace

Result<std::vector<NamedRaster>> list_sources(const SourceOptions& options) {
  SourceList list(options.zoom);
  for (const std::string& name : options.names)
    if (auto ok = list.add(name, 0); !ok) return fail(ok);
  std::vector<NamedRaster> rasters = list.take();
  if (rasters.empty()) return fail(Error::Kind::NotFound, "expected a source to build a map from, found none");
  return rasters;
}

}  // namespace nadir::mosaic
