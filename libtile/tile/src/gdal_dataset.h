#pragma once

#include <gdal_priv.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "nadir/base/result.h"

namespace nadir::tile {

struct CloseDataset {
  void operator()(GDALDataset* dataset) const noexcept { GDALClose(dataset); }
};
using Dataset = std::unique_ptr<GDALDataset, CloseDataset>;

/// Opens a raster with GDAL, its drivers registered on first use.
Result<Dataset> open_raster(const std::string& path);

/// Keeps GDAL's messages of this thread for an Error instead of printing them.
class GdalMessages {
 public:
  GdalMessages();
  ~GdalMessages();
  GdalMessages(const GdalMessages&) = delete;
  GdalMessages& operator=(const GdalMessages&) = delete;
  /// First error since construction (the cause; later ones follow from it), else the first warning, else empty.
  std::string first() const;
  bool failed() const { return !error_.empty(); }

 private:
  static void CPL_STDCALL collect(CPLErr severity, CPLErrorNum number, const char* message);
  std::string error_, warning_;
};

/// Handles of one raster: GDAL's serve one thread at a time, so each borrower gets its own.
/// Thread-safe.
class DatasetPool {
 public:
  DatasetPool(std::string path, Dataset first);

  Result<Dataset> borrow();
  void give_back(Dataset dataset);

 private:
  const std::string path_;
  std::mutex mutex_;  // guards idle_
  std::vector<Dataset> idle_;
};

}  // namespace nadir::tile
