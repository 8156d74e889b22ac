#pragma once

#include <algorithm>
#include <cstring>
#include <functional>
#include <memory>
#include <vector>

#include "nadir/render/sample_block.h"

namespace nadir::test {

/// One level of a map in cells that no file stands behind. Beyond its edge they hold what would show: 0xa5 in each byte.
class LevelInMemory {
 public:
  using Value = std::function<double(int col, int row, int band)>;
  using Valid = std::function<bool(int col, int row)>;

  /// `valid`: all, where it is empty.
  LevelInMemory(tile::SampleType type, int bands, int width, int height, const Value& value, const Valid& valid = {})
      : width_(width),
        height_(height),
        cols_((width + tile::cell_size - 1) / tile::cell_size),
        rows_((height + tile::cell_size - 1) / tile::cell_size) {
    for (std::int32_t col = 0; col < cols_; ++col) columns_.push_back(col);
    for (int row = 0; row < rows_; ++row)
      for (int col = 0; col < cols_; ++col) {
        auto cell = std::make_unique<tile::Cell>(type, bands);
        const std::size_t bytes = tile::cell_area * static_cast<std::size_t>(bands) * tile::size_bytes(type);
        std::memset(cell->samples(), 0xa5, bytes);
        tile::with_sample_type(type, [&]<class T>(T) { fill<T>(*cell, bands, col, row, value, valid); });
        pointers_.push_back(cell.get());
        cells_.push_back(std::move(cell));
      }
  }

  /// As level `level`, whose texels are `texels` of level 0 a side.
  render::LevelWindow window(int level = 0, double texels = 1, bool around = false) const {
    render::LevelWindow window{level, texels, texels, width_, height_};
    window.cols = cols_;
    window.rows = rows_;
    window.around = around;
    window.columns = columns_;
    window.cells = pointers_;
    return window;
  }

 private:
  template <class T>
  void fill(tile::Cell& cell, int bands, int col, int row, const Value& value, const Valid& valid) const {
    T* samples = reinterpret_cast<T*>(cell.samples());
    for (int y = 0; y < std::min(tile::cell_size, height_ - row * tile::cell_size); ++y)
      for (int x = 0; x < std::min(tile::cell_size, width_ - col * tile::cell_size); ++x) {
        const int at = y * tile::cell_size + x;
        const int level_col = col * tile::cell_size + x, level_row = row * tile::cell_size + y;
        for (int b = 0; b < bands; ++b) samples[at * bands + b] = static_cast<T>(value(level_col, level_row, b));
        if (valid && !valid(level_col, level_row)) cell.writable_validity()[at] = 0;
      }
  }

  int width_, height_, cols_, rows_;
  std::vector<std::int32_t> columns_;
  std::vector<std::unique_ptr<tile::Cell>> cells_;
  std::vector<const tile::Cell*> pointers_;
};

}  // namespace nadir::test
