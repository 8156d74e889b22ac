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
  height_ = std::min(block.rows * cell_size, level.height - block.row * cell_size);
  first_col_ = block.col == 0;
  first_row_ = block.row == 0;
  last_col_ = block.col * cell_size + width_ == level.width;
  last_row_ = block.row * cell_size + height_ == level.height;
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

  // The row of cells that it lies in, and the one whose apron it belongs to
  const int at = static_cast<int>(y), cell_row = at >> cell_size_log2, in_cell = at & (cell_size - 1);
  into_cells(cell_row, in_cell + cell_apron, samples, valid);
  if (in_cell == 0 && cell_row > 0) into_cells(cell_row - 1, cell_stride - 1, samples, valid);
  if (in_cell == cell_size - 1 && cell_row + 1 < block_.rows) into_cells(cell_row + 1, 0, samples, valid);
}

/// A row of texels into one row of each cell of a row of cells.
void BlockWriter::into_cells(int cell_row, int row_in_cell, const std::byte* samples, const std::uint8_t* valid) {
  for (int col = 0; col < block_.cols; ++col) {
    Cell* cell = cells_[static_cast<std::size_t>(cell_row * block_.cols + col)].get();
    if (!cell) continue;
    // Texels [first, end) of the row lie in this cell or in its apron
    const int first = std::max(col * cell_size - cell_apron, 0),
              end = std::min((col + 1) * cell_size + cell_apron, width_);
    const int left = first - (col * cell_size - cell_apron);  // of the stride that comes before: 0 or 1
    const auto count = static_cast<std::size_t>(end - first);
    const std::size_t begin = static_cast<std::size_t>(row_in_cell) * cell_stride;
    std::byte* to = cell->samples() + begin * texel_bytes_;
    const std::size_t at = static_cast<std::size_t>(left);
    std::memcpy(to + at * texel_bytes_, samples + static_cast<std::size_t>(first) * texel_bytes_, count * texel_bytes_);
    std::uint8_t* to_valid = nullptr;
    if (valid && std::memchr(valid + first, 0, count)) {
      to_valid = cell->writable_validity() + begin;
      std::memcpy(to_valid + at, valid + first, count);
      // What is invalid takes part in no average; zero instead of NaN keeps it from spreading through a product with
      // zero.
      for (std::size_t i = 0; i < count; ++i)
        if (!to_valid[at + i]) std::memset(to + (at + i) * texel_bytes_, 0, texel_bytes_);
    }
    // The level's edge goes on
    const auto repeat = [&](std::size_t from, std::size_t x) {
      std::memcpy(to + x * texel_bytes_, to + from * texel_bytes_, texel_bytes_);
      if (to_valid) to_valid[x] = to_valid[from];
    };
    if (col == 0 && first_col_) repeat(at, 0);
    if (col == block_.cols - 1 && last_col_)
      for (std::size_t x = at + count; x < cell_stride; ++x) repeat(at + count - 1, x);
  }
}

std::vector<std::shared_ptr<Cell>> BlockWriter::take() {
  for (int row = 0; row < block_.rows; ++row)
    for (int col = 0; col < block_.cols; ++col) {
      Cell* cell = cells_[static_cast<std::size_t>(row * block_.cols + col)].get();
      if (!cell) continue;
      const bool top = row == 0 && first_row_, bottom = row == block_.rows - 1 && last_row_;
      const auto copy_row = [&](int from, int to) {
        const std::size_t bytes = cell_stride * texel_bytes_;
        std::memcpy(cell->samples() + static_cast<std::size_t>(to) * bytes,
                    cell->samples() + static_cast<std::size_t>(from) * bytes, bytes);
        if (cell->masked())
          std::memcpy(cell->writable_validity() + to * cell_stride, cell->writable_validity() + from * cell_stride,
                      cell_stride);
      };
      const int last = height_ - row * cell_size;  // row in the cell of the level's last, where it ends here
      if (top) copy_row(cell_apron, 0);
      if (bottom)
        for (int y = last + 1; y < cell_stride; ++y) copy_row(last, y);
      const auto known = [](int side, int place, int count, bool begins, bool ends) {
        return side == 0 || (side < 0 ? place > 0 || begins : place + 1 < count || ends);
      };
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx)
          if (known(dx, col, block_.cols, first_col_, last_col_) && known(dy, row, block_.rows, first_row_, last_row_))
            cell->note_part({dx, dy});
    }
  return std::move(cells_);
}

}  // namespace nadir::tile
