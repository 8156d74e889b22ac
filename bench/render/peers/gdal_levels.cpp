#include "gdal_levels.h"

#include <algorithm>

namespace nadir::bench {

Result<GdalLevels> GdalLevels::open(const std::string& path) {
  static const bool ready = [] {
    GDALRegister_GTiff();
    GDALSetCacheMax64(peer_cache_bytes);
    return true;
  }();
  static_cast<void>(ready);
  const auto at_level = [&](int level) {
    const std::string option = "OVERVIEW_LEVEL=" + std::to_string(level - 1);
    const char* const options[] = {option.c_str(), nullptr};
    return std::unique_ptr<GDALDataset>(
        GDALDataset::Open(path.c_str(), GDAL_OF_RASTER, nullptr, level == 0 ? nullptr : options));
  };
  GdalLevels all;
  auto full = at_level(0);
  if (!full) return fail(Error::Kind::NotFound, path + ": GDAL cannot open it: " + CPLGetLastErrorMsg());
  const int overviews = full->GetRasterBand(1)->GetOverviewCount();
  all.levels_.push_back(std::move(full));
  for (int level = 1; level <= overviews; ++level) {
    all.levels_.push_back(at_level(level));
    if (!all.levels_.back()) return fail(Error::Kind::NotFound, path + ": GDAL cannot open one of its levels");
  }
  return all;
}

int GdalLevels::nearest(double texels) const {
  return std::clamp(static_cast<int>(std::lround(std::log2(std::max(texels, 1e-9)))), 0, count() - 1);
}

Result<void> GdalLevels::read(int level, int x, int y, int width, int height, void* out) const {
  const int sample = GDALGetDataTypeSizeBytes(type());
  const CPLErr done =
      dataset(level).RasterIO(GF_Read, x, y, width, height, out, width, height, type(), bands(), nullptr, texel_bytes(),
                              static_cast<GSpacing>(texel_bytes()) * width, sample, nullptr);
  if (done != CE_None) return fail(Error::Kind::Io, std::string("GDAL cannot read: ") + CPLGetLastErrorMsg());
  return {};
}

}  // namespace nadir::bench
