#include <algorithm>
#include <array>
#include <complex>

#include "block_source.h"
#include "nadir/gdal/dataset.h"
#include "sample_types.h"
#include "thread_memory.h"

namespace nadir::mosaic {
namespace {

/// Small blocks are read some together: each call costs, and virtual rasters decode what lies below more than once.
constexpr int least_side = 512;
constexpr std::uint64_t most_bytes = 4 << 20;

GDALDataType gdal_type(Sample sample) {
  // Before version 3.7 signed bytes come as unsigned ones, with the same bits.
  static constexpr std::array types = {GDT_Byte,  GDT_Byte,   GDT_UInt16, GDT_Int16,   GDT_UInt32,
                                       GDT_Int32, GDT_UInt64, GDT_Int64,  GDT_Float32, GDT_Float64};
  return types[static_cast<std::size_t>(sample)];
}

/// The natural block, and as many beside and below it as make a good read.
std::pair<int, int> block_size(const RasterHeader& header, const TexelType& type) {
  const tile::Level& size = header.description.levels.front();
  int width = std::min(size.tile_width, size.width), height = std::min(size.tile_height, size.height);
  const auto fits = [&](int w, int h) {
    return static_cast<std::uint64_t>(w) * static_cast<std::uint64_t>(h) * type.texel_bytes() <= most_bytes;
  };
  while (width < least_side && width < size.width && fits(2 * width, height)) width = std::min(2 * width, size.width);
  while (height < least_side && height < size.height && fits(width, 2 * height))
    height = std::min(2 * height, size.height);
  return {width, height};
}

/// Any raster, as GDAL reads it.
class GdalSource : public BlockSource {
 public:
  GdalSource(const RasterHeader& header, const Reading& reading, std::pair<int, int> block,
             std::shared_ptr<Shared> shared)
      : BlockSource(header, reading.rule.to, block.first, block.second, std::move(shared)),
        memory_(header.memory),
        bands_(reading.bands),
        conversion_(reading.rule),
        every_band_masked_(header.every_band_masked) {
    for (const int band : bands_) complex_ = complex_ || header.bands[static_cast<std::size_t>(band)].complex;
  }

 protected:
  Result<void> decode(Block& block) const override;

 private:
  CPLErr read_samples(GDALDataset& dataset, const Window& w, std::byte* out) const;
  CPLErr read_mask(GDALDataset& dataset, const Window& w, std::uint8_t* out) const;

  const std::shared_ptr<const MemoryFile> memory_;
  const std::vector<int> bands_;
  const Conversion conversion_;
  const bool every_band_masked_;
  bool complex_ = false;
};

CPLErr GdalSource::read_samples(GDALDataset& dataset, const Window& w, std::byte* out) const {
  const Sample stored = conversion_.rule().stored;
  const std::size_t count = bands_.size(),
                    texels = static_cast<std::size_t>(w.width) * static_cast<std::size_t>(w.height);
  std::vector<int> numbers;
  for (const int band : bands_) numbers.push_back(band + 1);
  const auto read = [&](void* to, GDALDataType type) {
    const auto sample = static_cast<GSpacing>(GDALGetDataTypeSizeBytes(type));
    const GSpacing texel = sample * static_cast<GSpacing>(count);
    return dataset.RasterIO(GF_Read, w.x, w.y, w.width, w.height, to, w.width, w.height, type, static_cast<int>(count),
                            numbers.data(), texel, texel * w.width, sample, nullptr);
  };
  if (!complex_) return read(out, gdal_type(stored));
  std::vector<std::complex<double>> values(texels * count);
  const CPLErr status = read(values.data(), GDT_CFloat64);
  if (status != CE_None) return status;
  tiff::with_sample(stored, [&]<class T>(T) {
    for (std::size_t i = 0; i < values.size(); ++i) reinterpret_cast<T*>(out)[i] = static_cast<T>(std::abs(values[i]));
  });
  return status;
}

CPLErr GdalSource::read_mask(GDALDataset& dataset, const Window& w, std::uint8_t* out) const {
  const std::size_t texels = static_cast<std::size_t>(w.width) * static_cast<std::size_t>(w.height);
  std::fill_n(out, texels, std::uint8_t{255});
  std::vector<std::uint8_t> mask(texels);
  for (const int band : bands_) {
    const CPLErr status = dataset.GetRasterBand(band + 1)->GetMaskBand()->RasterIO(
        GF_Read, w.x, w.y, w.width, w.height, mask.data(), w.width, w.height, GDT_Byte, 0, 0, nullptr);
    if (status != CE_None) return status;
    for (std::size_t i = 0; i < texels; ++i)
      if (mask[i] < 128) out[i] = 0;
    if (!every_band_masked_) break;  // the same one for all bands
  }
  return CE_None;
}

Result<void> GdalSource::decode(Block& block) const {
  static thread_local std::vector<std::byte> samples;
  static thread_local std::vector<std::uint8_t> mask;
  const ThreadMemory samples_memory(samples);
  const ThreadMemory mask_memory(mask);
  const Window& w = block.window();
  auto dataset = shared_->datasets.borrow(file_, w.y);
  if (!dataset) return fail(dataset);
  const bool masked = conversion_.rule().masked;
  const std::size_t texel = tiff::size_bytes(conversion_.rule().stored) * bands_.size();
  samples.resize(block.texels() * texel);
  mask.resize(masked ? block.texels() : 0);

  const gdal::GdalMessages messages;
  CPLErr status = read_samples(**dataset, w, samples.data());
  if (status == CE_None && masked) status = read_mask(**dataset, w, mask.data());
  // A handle that has failed may remember it.
  if (status != CE_None || messages.failed()) return damaged(w, gdal::without_path(messages.first(), file_.path));
  shared_->datasets.give_back(file_, std::int64_t{w.y} + w.height, std::move(*dataset));

  const auto texels = static_cast<std::size_t>(w.width);
  for (std::size_t line = 0; line < static_cast<std::size_t>(w.height); ++line) {
    const std::int32_t y = w.y + static_cast<std::int32_t>(line);
    conversion_.row(samples.data() + line * texels * texel, masked ? mask.data() + line * texels : nullptr, texels,
                    block.row(y), block.masked() ? block.valid_row(y) : nullptr);
  }
  return {};
}

}  // namespace

std::shared_ptr<const Source> make_gdal_source(const RasterHeader& header, const Reading& reading,
                                               std::shared_ptr<Shared> shared) {
  return std::make_shared<const GdalSource>(header, reading, block_size(header, reading.rule.to), std::move(shared));
}

}  // namespace nadir::mosaic
