#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "nadir/tiff/sample.h"
#include "nadir/tile/map.h"

namespace nadir::mosaic {

using tiff::Sample;
using tile::Window;

/// What the texels of a map in the making are, the same in all levels and steps.
struct TexelType {
  Sample sample = Sample::U8;
  int bands = 1;                 // alpha included, interleaved
  bool alpha = false;            // the last band is opacity
  bool mask = false;             // validity lies beside the samples
  std::optional<double> nodata;  // what a data band holds where it has no data; may be NaN

  int data_bands() const { return bands - (alpha ? 1 : 0); }
  std::size_t texel_bytes() const { return tiff::size_bytes(sample) * static_cast<std::size_t>(bands); }
};

/// Texels of a window of one level: rows from the top, bands interleaved, and where the type has a mask a byte each
/// for validity, 255 or 0. What is in a fresh one is undefined.
class Block {
 public:
  Block() = default;
  Block(const TexelType& type, const Window& window) { reset(type, window); }

  /// Another window. Keeps its memory where that is enough.
  void reset(const TexelType& type, const Window& window) {
    const auto texels = static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height);
    texel_bytes_ = type.texel_bytes();
    window_ = window;
    samples_.reserve(texels * texel_bytes_);
    valid_.reserve(type.mask ? texels : 0);
    masked_ = type.mask;
  }

  /// Renames texels: the window moves, samples stay.
  void move_by(std::int32_t columns, std::int32_t rows) {
    window_.x += columns;
    window_.y += rows;
  }

  const Window& window() const { return window_; }
  bool masked() const { return masked_; }
  std::size_t texel_bytes() const { return texel_bytes_; }
  std::size_t row_bytes() const { return static_cast<std::size_t>(window_.width) * texel_bytes_; }
  std::size_t texels() const {
    return static_cast<std::size_t>(window_.width) * static_cast<std::size_t>(window_.height);
  }

  /// Row `y` of the level, from the window's first column on.
  std::byte* row(std::int32_t y) { return samples_.data() + row_offset(y) * texel_bytes_; }
  const std::byte* row(std::int32_t y) const { return samples_.data() + row_offset(y) * texel_bytes_; }
  std::uint8_t* valid_row(std::int32_t y) { return valid_.data() + row_offset(y); }  // only where masked()
  const std::uint8_t* valid_row(std::int32_t y) const { return valid_.data() + row_offset(y); }

 private:
  /// Bytes that are not set to zero first.
  template <class T>
  class Memory {
   public:
    void reserve(std::size_t size) {
      if (size <= size_) return;
      bytes_.reset(new T[size]);
      size_ = size;
    }
    T* data() { return bytes_.get(); }
    const T* data() const { return bytes_.get(); }

   private:
    std::unique_ptr<T[]> bytes_;
    std::size_t size_ = 0;
  };

  std::size_t row_offset(std::int32_t y) const {
    return static_cast<std::size_t>(y - window_.y) * static_cast<std::size_t>(window_.width);
  }

  Window window_;
  std::size_t texel_bytes_ = 1;
  bool masked_ = false;
  Memory<std::byte> samples_;
  Memory<std::uint8_t> valid_;
};

/// Whether a texel can say that it holds no data; NaN alone does not count.
inline bool tells_holes(const TexelType& type) { return type.mask || type.alpha || type.nodata.has_value(); }

/// Makes all texels empty: nodata where the type has it, masked, transparent; else NaN, or 0 in integers.
void clear(const TexelType& type, Block& block);

}  // namespace nadir::mosaic
