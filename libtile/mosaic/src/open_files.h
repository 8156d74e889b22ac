#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>

#include "nadir/base/result.h"
#include "nadir/gdal/dataset.h"
#include "nadir/tiff/tiff_file.h"

namespace nadir::mosaic {

/// A file as it was when its headers were read.
struct SourceFile {
  std::string path;   // what opens it
  std::string label;  // what the user called it
  std::uint64_t bytes = 0;
  std::int64_t changed_ns = 0;  // when it was last written
  bool on_disk = false;         // else what only GDAL finds: nothing can be said of its changes

  static SourceFile look_at(std::string path, std::string label);

  /// Io, naming it, where it is another one by now, or gone.
  Result<void> check_unchanged() const;
};

/// Opens what GDAL reads, for reading in the caller's thread only. GDAL looks for each file beside it by name, instead
/// of listing its folder, which takes as long as there are files in it, for each of them.
Result<gdal::Dataset> open_dataset(const std::string& path);

/// TIFFs that are open, the last used of them: sources may be more than a process may open.
/// Thread-safe.
class OpenTiffs {
 public:
  explicit OpenTiffs(std::size_t most) : most_(most) {}

  /// Opened where it is not; what was read of it before is checked to hold still.
  Result<std::shared_ptr<const tiff::TiffFile>> get(const SourceFile& file);

 private:
  using Entry = std::pair<std::string, std::shared_ptr<const tiff::TiffFile>>;
  const std::size_t most_;
  std::mutex mutex_;       // guards what follows; not held while opening
  std::list<Entry> used_;  // last used first
  std::unordered_map<std::string, std::list<Entry>::iterator> by_path_;
};

/// GDAL's handles of many rasters, each serving one borrower at a time; the last used are kept open.
/// Thread-safe.
class OpenDatasets {
 public:
  explicit OpenDatasets(std::size_t most_idle) : most_idle_(most_idle) {}

  /// Of those that are open, the one whose last row read comes next before `row`: some formats are read from the top
  /// only, and begin anew for a row that has gone by.
  Result<gdal::Dataset> borrow(const SourceFile& file, std::int64_t row);
  /// `row`: the one after the last that was read.
  void give_back(const SourceFile& file, std::int64_t row, gdal::Dataset dataset);

 private:
  struct Idle {
    std::string path;
    std::int64_t row;
    gdal::Dataset dataset;
  };
  const std::size_t most_idle_;
  std::mutex mutex_;  // guards idle_
  std::list<Idle> idle_;
};

}  // namespace nadir::mosaic
