#pragma once

#include <gdal_priv.h>

#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "nadir/base/result.h"

namespace nadir::gdal {

struct CloseDataset {
  void operator()(GDALDataset* dataset) const noexcept { GDALClose(dataset); }
};
using Dataset = std::unique_ptr<GDALDataset, CloseDataset>;

/// Opens a raster with GDAL, its drivers registered on first use, for reading in the caller's thread only.
Result<Dataset> open_raster(const std::string& path);

/// Keeps GDAL's messages of this thread for an Error instead of printing them.
class GdalMessages {
 public:
  GdalMessages();
  ~GdalMessages();
  GdalMessages(const GdalMessages&) = delete;
  GdalMessages& operator=(const GdalMessages&) = delete;
  /// First error since construction (while reading, the cause; later ones follow from it), else the first warning, else
  /// empty.
  const std::string& first() const { return error_.empty() ? warning_ : error_; }
  /// Last error since construction (while opening, the one that decided), else the first warning, else empty.
  const std::string& last() const { return last_error_.empty() ? warning_ : last_error_; }
  bool failed() const { return !error_.empty(); }

 private:
  static void CPL_STDCALL collect(CPLErr severity, CPLErrorNum number, const char* message);
  std::string error_, last_error_, warning_;
};

/// Keeps GDAL from printing, on any thread, while it is in scope: its own threads have no handler of theirs, and what
/// fails there fails in the caller's thread too.
class QuietGdal {
 public:
  QuietGdal() : before_(CPLSetErrorHandler(CPLQuietErrorHandler)) {}
  ~QuietGdal() { CPLSetErrorHandler(before_); }
  QuietGdal(const QuietGdal&) = delete;
  QuietGdal& operator=(const QuietGdal&) = delete;

 private:
  CPLErrorHandler before_;
};

/// GDAL's message about a file without the name that it often has in it, for an Error that begins with that name.
std::string without_path(std::string_view message, std::string_view path);

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

}  // namespace nadir::gdal
