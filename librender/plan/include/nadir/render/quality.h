#pragma once

#include <string_view>

#include "nadir/base/result.h"

namespace nadir::render {

/// How a pixel becomes a value.
enum class Filter {
  Nearest,    // the texel at the pixel's centre: for labels, which are never blended
  Bilinear,   // one bilinear sample on the level nearest to the footprint's size
  Bicubic,    // one cubic sample on the finer of the two levels around the footprint's size: for 1:1 and closer
  Mip,        // bilinear samples along the footprint, each blended between the two levels around its size
  Reference,  // bilinear samples of level 0, 8 or more a side, 2 or more a texel: the definition of the right picture;
              // slow
};
std::string_view to_string(Filter filter);
Result<Filter> parse_filter(std::string_view text);

/// Points on the curve of error against run time.
enum class Quality {
  draft,     // Bilinear
  balanced,  // Mip, 1.6 samples across the footprint's shorter axis, rounded up
  best,      // Mip, 3.1 samples across it; where a pixel spans a texel or less, Bicubic
};
std::string_view to_string(Quality quality);
Result<Quality> parse_quality(std::string_view text);

/// Reference takes at least so many samples a texel along each side of a pixel, and of a pixel that spans fewer texels
/// than this as many as if it spanned them. It is then within 0.03 grey levels of 255 of the mean that it stands for,
/// a third of what any other filter errs by, and four times nearer with twice the samples.
inline constexpr double least_reference_oversampling = 2, least_reference_texels = 4;

/// What a quality means for a layer; a filter may be forced.
struct Sampling {
  Filter filter = Filter::Mip;
  double oversampling = 1;     // samples across the footprint's shorter axis; of Reference: a texel
  double level_blend = 1;      // of Mip: LevelBlend::band
  bool cubic_details = false;  // of Mip: one cubic sample in blocks whose pixels span at most `most_detail_texels`
};
/// Up to here a cubic sample shows more of the true ground than a mean of bilinear ones, by 2 to 4 dB.
inline constexpr double most_detail_texels = 1.2;
Sampling sampling_for(Quality quality);

}  // namespace nadir::render
