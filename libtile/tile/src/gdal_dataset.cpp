#include "gdal_dataset.h"

#include <cpl_conv.h>
#include <fmt/format.h>

#include <filesystem>

#include "nadir/base/text.h"
#include "nadir/tile/map.h"

namespace nadir::tile {

GdalMessages::GdalMessages() {
  CPLPushErrorHandlerEx(&GdalMessages::collect, this);
  CPLErrorReset();
}
GdalMessages::~GdalMessages() { CPLPopErrorHandler(); }

void CPL_STDCALL GdalMessages::collect(CPLErr severity, CPLErrorNum, const char* message) {
  auto* self = static_cast<GdalMessages*>(CPLGetErrorHandlerUserData());
  std::string& kept = severity >= CE_Failure ? self->error_ : self->warning_;
  if (severity >= CE_Warning && kept.empty()) kept = trim(message);
}

std::string GdalMessages::first() const { return error_.empty() ? warning_ : error_; }

Result<Dataset> open_raster(const std::string& path) {
  static std::once_flag registered;
  std::call_once(registered, [] { GDALAllRegister(); });
  const GdalMessages messages;
  Dataset dataset{static_cast<GDALDataset*>(
      GDALOpenEx(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY | GDAL_OF_VERBOSE_ERROR, nullptr, nullptr, nullptr))};
  if (dataset && dataset->GetRasterCount() > 0) return dataset;
  std::error_code error;
  const bool there = std::filesystem::exists(path, error);
  if (!there && path.find(':') == std::string::npos && !path.starts_with("/vsi"))
    return fail(Error::Kind::NotFound, fmt::format("{}: no such file", path));
  if (dataset) return fail(Error::Kind::Malformed, fmt::format("{}: expected a raster, found no band in it", path));
  const std::string reason = messages.first();
  return fail(Error::Kind::Malformed,
              fmt::format("{}: expected a raster that GDAL can read: {}", path, reason.empty() ? "format not recognised" : reason));
}

DatasetPool::DatasetPool(std::string path, Dataset first) : path_(std::move(path)) { idle_.push_back(std::move(first)); }

Result<Dataset> DatasetPool::borrow() {
  {
    std::scoped_lock lock(mutex_);
    if (!idle_.empty()) {
      Dataset dataset = std::move(idle_.back());
      idle_.pop_back();
      return dataset;
    }
  }
  return open_raster(path_);
}

void DatasetPool::give_back(Dataset dataset) {
  std::scoped_lock lock(mutex_);
  idle_.push_back(std::move(dataset));
}

void limit_gdal_block_cache(std::uint64_t bytes) {
  if (!CPLGetConfigOption("GDAL_CACHEMAX", nullptr)) GDALSetCacheMax64(static_cast<GIntBig>(bytes));
}

}  // namespace nadir::tile
