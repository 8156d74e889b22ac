#include "tiff_rows.h"

#include <cstring>

namespace nadir::mosaic {

TiffRows rows_of(const RasterHeader& header, const Reading& reading) {
  const tiff::TileFormat& format = header.tiff->image_directory.format;
  TiffRows rows{reading.rule, {}, {}};
  std::vector<int> bands = reading.bands;  // in a row
  if (format.separate) {
    for (const int band : bands) rows.planes.push_back(static_cast<std::uint32_t>(band));
  } else {
    const auto among_all = [&](Channel& channel) { channel.band = bands[static_cast<std::size_t>(channel.band)]; };
    for (Channel& channel : rows.rule.data) among_all(channel);
    if (rows.rule.alpha) among_all(*rows.rule.alpha);
    rows.rule.pitch = static_cast<int>(format.samples);
    rows.planes = {0};
    bands.resize(format.samples);
    for (int b = 0; b < static_cast<int>(bands.size()); ++b) bands[static_cast<std::size_t>(b)] = b;
  }

  tiff::with_sample(rows.rule.stored, [&]<class T>(T) {
    rows.missing.resize(bands.size() * sizeof(T));
    for (std::size_t i = 0; i < bands.size(); ++i) {
      const bool alpha = rows.rule.alpha && rows.rule.alpha->band == static_cast<int>(i);
      const auto& nodata = header.bands[static_cast<std::size_t>(bands[i])].nodata;
      const T value = nodata && !alpha ? static_cast<T>(*nodata) : T{};
      std::memcpy(rows.missing.data() + i * sizeof(T), &value, sizeof value);
    }
  });
  return rows;
}

}  // namespace nadir::mosaic
