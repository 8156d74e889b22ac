#include "nadir/gdal/dataset.h"

#include <cpl_conv.h>
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "nadir/base/text.h"
#include "nadir/gdal/raster.h"

namespace nadir::gdal {
namespace {

/// While in scope, datasets opened by this thread decode in their caller's thread, whatever GDAL_NUM_THREADS says. Our
/// own threads read side by side already, and what GDAL's tell reaches no handler of ours: it would be printed, and the
/// cause lost.
class DecodeInCaller {
 public:
  DecodeInCaller() { CPLSetThreadLocalConfigOption("GDAL_NUM_THREADS", "1"); }
  ~DecodeInCaller() { CPLSetThreadLocalConfigOption("GDAL_NUM_THREADS", before_ ? before_->c_str() : nullptr); }
  DecodeInCaller(const DecodeInCaller&) = delete;
  DecodeInCaller& operator=(const DecodeInCaller&) = delete;

 private:
  static std::optional<std::string> current() {
    const char* value = CPLGetThreadLocalConfigOption("GDAL_NUM_THREADS", nullptr);
    return value ? std::optional<std::string>(value) : std::nullopt;
  }
  const std::optional<std::string> before_ = current();
};

/// While in scope, GDAL does not look for files beside one that is far away: each look is a journey.
class NothingBeside {
 public:
  explicit NothingBeside(const std::string& path) : far_(path.starts_with("/vsi")) {
    if (far_) CPLSetThreadLocalConfigOption("GDAL_DISABLE_READDIR_ON_OPEN", "EMPTY_DIR");
  }
  ~NothingBeside() {
    if (far_) CPLSetThreadLocalConfigOption("GDAL_DISABLE_READDIR_ON_OPEN", nullptr);
  }
  NothingBeside(const NothingBeside&) = delete;
  NothingBeside& operator=(const NothingBeside&) = delete;

 private:
  const bool far_;
};

/// Whether a warning says that texels were made up: libjpeg goes on with grey where a tile's data are damaged.
bool tells_damage(std::string_view warning) {
  return warning.find("JPEGLib:") != std::string_view::npos || warning.find("libjpeg:") != std::string_view::npos;
}

}  // namespace

GdalMessages::GdalMessages() {
  CPLPushErrorHandlerEx(&GdalMessages::collect, this);
  CPLErrorReset();
}
GdalMessages::~GdalMessages() { CPLPopErrorHandler(); }

void CPL_STDCALL GdalMessages::collect(CPLErr severity, CPLErrorNum, const char* message) {
  auto* self = static_cast<GdalMessages*>(CPLGetErrorHandlerUserData());
  if (severity < CE_Warning) return;
  const std::string text(trim(message));
  const bool error = severity >= CE_Failure || tells_damage(text);
  std::string& first = error ? self->error_ : self->warning_;
  if (first.empty()) first = text;
  if (error) self->last_error_ = text;
}

std::string without_path(std::string_view message, std::string_view path) {
  const std::size_t at = path.empty() ? std::string_view::npos : message.find(path);
  if (at == std::string_view::npos) return std::string(message);
  std::string_view rest = message.substr(at + path.size());
  rest.remove_prefix(std::min(rest.find_first_not_of(":, "), rest.size()));
  return std::string(message.substr(0, at)) + std::string(rest);
}

Result<Dataset> open_raster(const std::string& path) {
  static std::once_flag registered;
  std::call_once(registered, [] { GDALAllRegister(); });
  if (path.empty()) return fail(Error::Kind::NotFound, "expected the path of a raster, found an empty one");
  const GdalMessages messages;
  const DecodeInCaller decode_in_caller;
  const NothingBeside nothing_beside(path);
  Dataset dataset{static_cast<GDALDataset*>(
      GDALOpenEx(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY | GDAL_OF_VERBOSE_ERROR, nullptr, nullptr, nullptr))};
  if (dataset && dataset->GetRasterCount() > 0) return dataset;
  std::error_code error;
  const bool there = std::filesystem::exists(path, error);
  if (!there && path.find(':') == std::string::npos && !path.starts_with("/vsi"))
    return fail(Error::Kind::NotFound, fmt::format("{}: no such file", path));
  if (dataset) return fail(Error::Kind::Malformed, fmt::format("{}: expected a raster, found no band in it", path));
  if (std::filesystem::is_directory(path, error))
    return fail(
        Error::Kind::Malformed,
        fmt::format("{}: expected a raster, found a folder; `nadir build` makes one of a folder of map tiles", path));
  return fail(Error::Kind::Malformed, fmt::format("{}: expected a raster that GDAL can read: {}; fetch it again if it "
                                                  "may be damaged, else convert it to GeoTIFF",
                                                  path, without_path(messages.last(), path)));
}

DatasetPool::DatasetPool(std::string path, Dataset first) : path_(std::move(path)) {
  idle_.push_back(std::move(first));
}

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

void limit_block_cache(std::uint64_t bytes) {
  if (!CPLGetConfigOption("GDAL_CACHEMAX", nullptr)) GDALSetCacheMax64(static_cast<GIntBig>(bytes));
}

}  // namespace nadir::gdal
