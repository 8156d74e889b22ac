#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "nadir/base/result.h"

namespace nadir::record {

/// A text file of GeoJSON that grows: a FeatureCollection, a Feature a line. It is whole after each call, so that a run
/// that ends in its middle leaves all but what it was just adding.
class FeatureFile {
 public:
  static Result<FeatureFile> create(const std::filesystem::path& path);
  /// Features as text, each on one line.
  Result<void> add(const std::vector<std::string>& features);

 private:
  Result<void> write(const std::string& text);

  struct CloseFile {
    void operator()(std::FILE* file) const noexcept { std::fclose(file); }
  };
  std::filesystem::path path_;
  std::unique_ptr<std::FILE, CloseFile> file_;
  long end_ = 0;  // of the last feature: where the closing brackets begin
  bool empty_ = true;
};

}  // namespace nadir::record
