#include "nadir/record/banded_frame.h"

#include <algorithm>
#include <cassert>

#include "frame_paths.h"

namespace nadir::record {

void PackedValidity::add(std::span<const std::uint8_t> validity) {
  for (; !validity.empty(); validity = validity.subspan(width_)) {
    const auto pixels = validity.first(width_);
    Row row{pixels[0] != 0, {}};
    if (std::any_of(pixels.begin(), pixels.end(), [&](std::uint8_t v) { return (v != 0) != row.first; }))
      row.pixels.assign(pixels.begin(), pixels.end());
    rows_.push_back(std::move(row));
  }
}

std::vector<std::uint8_t> PackedValidity::row(std::size_t y) const {
  const Row& row = rows_[y];
  if (row.pixels.empty()) return std::vector<std::uint8_t>(width_, row.first);
  return {row.pixels.begin(), row.pixels.end()};
}

std::size_t PackedValidity::held_bytes() const {
  std::size_t bytes = rows_.size() * sizeof(Row);
  for (const Row& row : rows_) bytes += row.pixels.capacity() / 8;
  return bytes;
}

Result<void> BandedFrame::begin(const render::FrameLayer& band) {
  const std::string name = stem_of(vehicle_, band.name, time_ns_) + image_ending(band);
  auto rows = images_->begin(folder_ / name, {nullptr, band.type, band.width, band.truth.height, band.bands});
  if (!rows) return fail(rows);
  layers_.push_back({name, std::move(*rows), {}, PackedValidity(band.width)});
  return {};
}

Result<void> BandedFrame::add(const render::Frame& band) {
  if (layers_.empty())
    for (const render::FrameLayer& layer : band.layers())
      if (auto ok = begin(layer); !ok) return ok;
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    const render::FrameLayer& layer = band.layers()[i];
    if (auto ok = layers_[i].rows->add(layer.samples.data(), layer.height); !ok) return ok;
    layers_[i].checksum.add(layer.samples);
    layers_[i].validity.add(layer.validity);
  }
  return {};
}

Result<void> BandedFrame::write_mask(const std::string& name, const render::FrameLayer& whole,
                                     const PackedValidity& validity) {
  const auto rows = images_->begin(folder_ / name, {nullptr, tile::SampleType::UInt8, whole.width, whole.height, 1});
  if (!rows) return fail(rows);
  for (std::size_t y = 0; y < validity.rows(); ++y) {
    std::vector<std::uint8_t> grey = validity.row(y);
    for (std::uint8_t& v : grey) v = v ? 255 : 0;
    if (auto ok = (*rows)->add(grey.data(), 1); !ok) return ok;
  }
  return (*rows)->finish();
}

Result<FrameRecords> BandedFrame::finish(const render::Frame& whole) {
  assert(layers_.size() == whole.layers().size());
  FrameRecords records;
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    const render::FrameLayer& layer = whole.layers()[i];
    LayerFile& written = layers_[i];
    if (auto ok = written.rows->finish(); !ok) return fail(ok);
    FrameFile file{written.name, {}, {}, vehicle_, layer.name, time_ns_};
    if (masks_ && layer.truth.valid_fraction < 1) {
      file.mask_file = stem_of(vehicle_, layer.name, time_ns_) + ".mask.png";
      if (auto ok = write_mask(file.mask_file, layer, written.validity); !ok) return fail(ok);
    }
    for (std::size_t y = 0; y < written.validity.rows(); ++y) {
      const std::vector<std::uint8_t> row = written.validity.row(y);
      written.checksum.add(std::as_bytes(std::span(row)));
    }
    records.lines += frame_record(file, layer, written.checksum.text()) + "\n";
    records.features.push_back(footprint_feature(file, layer));
  }
  return records;
}

}  // namespace nadir::record
