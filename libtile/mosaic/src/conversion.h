#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "nadir/mosaic/block.h"

namespace nadir::mosaic {

/// Red, green, blue and alpha of each index.
using Palette = std::vector<std::array<std::uint8_t, 4>>;

/// Where a band of the map comes from: a band of a raster, from 0, or one of the colours that its index stands for.
struct Channel {
  int band = 0;
  int color = -1;  // component of the palette; -1: the sample itself
  friend bool operator==(const Channel&, const Channel&) = default;
};

/// What rows of a raster are and become.
struct ConversionRule {
  Sample stored = Sample::U8;
  int pitch = 1;                              // samples of a texel in a row; channels count among them
  std::vector<Channel> data;                  // for each data band of the map
  std::optional<Channel> alpha;               // opaque where there is none and the map has alpha
  Sample alpha_stored = Sample::U8;           // whose largest value is opaque
  std::vector<std::optional<double>> nodata;  // of each in `data`, as the stored type holds it
  Palette palette;
  bool masked = false;  // validity comes with the rows
  TexelType to;
};

/// Rows of a raster as rows of the map.
/// Thread-safe.
class Conversion {
 public:
  explicit Conversion(ConversionRule rule);

  const ConversionRule& rule() const { return rule_; }

  /// Whether samples become what they are, and say nothing of validity beside them.
  bool copies() const { return copies_samples_ && !nodata_clears_ && !alpha_clears_; }

  /// `mask`: 255 or 0 for each texel, null where all are valid; `valid`: only where the map has a mask.
  /// `from` lies aligned for its type.
  void row(const std::byte* from, const std::uint8_t* mask, std::size_t texels, std::byte* to,
           std::uint8_t* valid) const;

 private:
  void clear_invalid(const std::byte* from, std::size_t texels, std::uint8_t* valid) const;
  void convert_data(const std::byte* from, std::size_t texels, std::byte* to) const;
  void convert_alpha(const std::byte* from, const std::uint8_t* valid, std::size_t texels, std::byte* to) const;

  const ConversionRule rule_;
  bool nodata_clears_;  // mask or alpha says what nodata said
  bool alpha_clears_;   // the mask says what alpha said
  bool copies_samples_;
};

}  // namespace nadir::mosaic
