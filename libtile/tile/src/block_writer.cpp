#include "block_writer.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace nadir::tile {

BlockWriter::BlockWriter(const CellSource& source, SampleType stored, const CellBlock& block,
                         std::span<const std::uint8_t> wanted)
    : source_(source),
      stored_(stored),
      block_(block),
      nodata_(source.map().description(), source.bands(), stored),
      texel_bytes_(source.bands().size() * size_bytes(source.type())) {
  const Level& level = source.map().levels()[static_cast<std::size_t>(block.level)];
  width_ = std::min(block.cols * cell_size, level.width - block.col * cell_size);
  for (std::size_t i = 0; i < block.size(); ++i)
    cells_.push_back(wanted.empty() || wanted[i]
                         ? std::make_shared<Cell>(source.type(), static_cast<int>(source.bands().size()))
                         : nullptr);
}

void BlockWriter::row(std::uint32_t y, const std::byte* samples, const std::uint8_t* valid) {
  const auto texels = static_cast<std::size_t>(width_);
  // What nodata and NaN say comes on top of mask and alpha
  if (!nodata_.never()) {
    if (valid)
      valid_.assign(valid, valid + texels);
    else
      valid_.assign(texels, 1);
    nodata_.check(samples, texels, valid_.data());
    valid = valid_.data();
  }
  if (valid && !std::memchr(valid, 0, texels)) valid = nullptr;

  if (source_.domain() == Domain::Decibel) {
    power_.resize(texels * source_.bands().size());
    with_sample_type(stored_, [&]<class T>(T) {
      const T* decibels = reinterpret_cast<const T*>(samples);
      // Samples of invalid texels may be NaN; zero power keeps arithmetic on them harmless.
      for (std::size_t i = 0; i < power_.size(); ++i) {
        const float value = static_cast<float>(decibels[i]);
        power_[i] = std::isfinite(value) ? std::pow(10.0f, value / 10.0f) : 0.0f;
      }
    });
    samples = reinterpret_cast<const std::byte*>(power_.data());
  }

  const int at = static_cast<int>(y);
  for (int col = 0; col < block_.cols; ++col) {
    Cell* cell = cells_[static_cast<std::size_t>((at >> cell_size_log2) * block_.cols + col)].get();
    if (!cell) continue;
    const auto first = static_cast<std::size_t>(col) * cell_size,
               count = std::min<std::size_t>(cell_size, texels - first);
    const std::size_t begin = static_cast<std::size_t>(at & (cell_size - 1)) * cell_size;
    std::byte* to = cell->samples() + begin * texel_bytes_;
    std::memcpy(to, samples + first * texel_bytes_, count * texel_bytes_);
    if (!valid || !std::memchr(valid + first, 0, count)) continue;
    std::memcpy(cell->writable_validity() + begin, valid + first, count);
    // What is invalid takes part in no average; zero instead of NaN keeps it from spreading through a product with
    // zero.
    for (std::size_t i = 0; i < count; ++i)
      if (!valid[first + i]) std::memset(to + i * texel_bytes_, 0, texel_bytes_);
  }
}

}  // namespace nadir::tile
