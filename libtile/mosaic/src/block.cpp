#include "nadir/mosaic/block.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace nadir::mosaic {

void clear(const TexelType& type, Block& block) {
  const Window& window = block.window();
  tiff::with_sample(type.sample, [&](auto sample) {
    using T = decltype(sample);
    T nothing{};
    if (type.nodata)
      nothing = static_cast<T>(*type.nodata);
    else if (std::is_floating_point_v<T> && !type.mask && !type.alpha)
      nothing = std::numeric_limits<T>::quiet_NaN();
    for (std::int32_t y = window.y; y < window.y + window.height; ++y) {
      T* row = reinterpret_cast<T*>(block.row(y));
      const std::size_t samples = static_cast<std::size_t>(window.width) * static_cast<std::size_t>(type.bands);
      std::fill_n(row, samples, nothing);
      if (type.alpha && nothing != T{})
        for (std::size_t i = static_cast<std::size_t>(type.data_bands()); i < samples;
             i += static_cast<std::size_t>(type.bands))
          row[i] = T{};
      if (block.masked()) std::fill_n(block.valid_row(y), window.width, std::uint8_t{0});
    }
  });
}

}  // namespace nadir::mosaic
