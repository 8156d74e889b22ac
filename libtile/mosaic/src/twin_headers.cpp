#include "twin_headers.h"

#include <algorithm>
#include <array>
#include <filesystem>

namespace nadir::mosaic {
namespace {

namespace tag = tiff::tag;

constexpr std::size_t most_known = 64;
constexpr std::uint64_t most_bytes = 64 << 10;  // of fields: more is read once only, by GDAL

/// Where data lie: that tells nothing of what they are.
constexpr std::array<std::uint16_t, 4> places = {273, 279, 324, 325};

std::uint64_t element_bytes(std::uint16_t type) {
  static constexpr std::array<std::uint64_t, 19> sizes = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8, 4, 0, 0, 8, 8, 8};
  return type < sizes.size() ? sizes[type] : 0;
}

/// Files in which GDAL looks for more.
bool has_companions(const std::string& path) {
  static constexpr std::array suffixes = {".aux.xml", ".ovr", ".msk", ".OVR", ".MSK"};
  return std::any_of(suffixes.begin(), suffixes.end(), [&](const char* suffix) {
    std::error_code error;
    return std::filesystem::exists(path + suffix, error);
  });
}

void append_number(std::string& text, std::uint64_t number) {
  text.append(reinterpret_cast<const char*>(&number), sizeof number);
}

}  // namespace

std::optional<TwinHeaders::Fields> TwinHeaders::fields_of(const tiff::TiffFile& tiff) {
  Fields fields;
  const auto& directories = tiff.directories();
  append_number(fields.same, directories.size() * 2 + (tiff.cloud_optimized() ? 1 : 0));
  bool placed = false;
  for (const tiff::Directory& directory : directories) {
    append_number(fields.same, directory.fields.size() * 2 + (directory.format.big_endian ? 1 : 0));
    for (const tiff::Field& field : directory.fields) {
      append_number(fields.same, field.tag);
      if (std::find(places.begin(), places.end(), field.tag) != places.end()) continue;
      const bool first = &directory == &directories.front();
      if (first && field.tag == tag::model_tie_points) {
        const auto ties = tiff.numbers(field);
        if (!ties || ties->size() != 6 || (*ties)[0] != 0 || (*ties)[1] != 0) return std::nullopt;
        fields.x = (*ties)[3];
        fields.y = (*ties)[4];
        placed = true;
        continue;
      }
      if (first && field.tag == tag::date_time) {
        fields.date_time = tiff.text(field).value_or("");
        continue;
      }
      const std::uint64_t size = element_bytes(field.type);
      if (size == 0 || field.count > most_bytes / size || fields.same.size() > most_bytes) return std::nullopt;
      append_number(fields.same, field.type);
      append_number(fields.same, field.count);
      const std::size_t at = fields.same.size(), bytes = static_cast<std::size_t>(field.count * size);
      fields.same.resize(at + bytes);
      if (!tiff.source().read(field.place, std::as_writable_bytes(std::span(fields.same).subspan(at))))
        return std::nullopt;
    }
  }
  return placed ? std::optional(std::move(fields)) : std::nullopt;
}

Result<RasterHeader> TwinHeaders::read(const NamedRaster& raster) {
  std::shared_ptr<const tiff::TiffFile> tiff;
  std::optional<Fields> fields;
  const SourceFile file = SourceFile::look_at(raster.path, raster.label);
  if (file.on_disk && !has_companions(raster.path))
    if (auto bytes = LocalFile::open(raster.path))
      if (auto opened = tiff::TiffFile::open(std::move(*bytes))) {
        tiff = std::move(*opened);
        fields = fields_of(*tiff);
      }
  if (!fields) return read_header(raster);

  std::shared_ptr<const Known> known;
  {
    const std::scoped_lock lock(mutex_);
    if (const auto it = known_.find(fields->same); it != known_.end()) known = it->second;
  }
  if (!known) {
    auto header = read_header(raster);
    // Where the tie point is the corner of the first texel, all of its twins are laid out as this one is.
    const bool plain_place =
        header && header->tiff && header->description.georeference && !header->pixel_is_point &&
        header->description.georeference->crs_from_texel.translation() == Eigen::Vector2d(fields->x, fields->y);
    if (!plain_place) return header;
    const std::scoped_lock lock(mutex_);
    if (known_.size() < most_known)
      known_.emplace(fields->same, std::make_shared<const Known>(Known{*header, *fields}));
    return header;
  }

  RasterHeader header = known->header;
  header.file = file;
  header.description.path = raster.label;
  header.description.georeference->crs_from_texel.translation() = Eigen::Vector2d(fields->x, fields->y);
  if (header.description.acquired == known->fields.date_time) header.description.acquired = fields->date_time;
  for (auto& [key, value] : header.metadata)
    if (key == "TIFFTAG_DATETIME") value = fields->date_time;
  const std::scoped_lock lock(mutex_);
  ++twins_;
  return header;
}

}  // namespace nadir::mosaic
