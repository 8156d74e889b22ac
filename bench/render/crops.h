#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "contestants.h"

namespace nadir::bench {

/// A part of a view's frames enlarged to 400 %, each method's beside the ideal. For three bands of bytes.
class Crops {
 public:
  explicit Crops(std::shared_ptr<const ViewSetting> setting) : setting_(std::move(setting)) {}

  void add(const std::string& caption, const std::string& frame);
  /// Writes the picture.
  Result<void> write(const std::filesystem::path& path, const std::string& title) const;

 private:
  std::shared_ptr<const ViewSetting> setting_;
  std::vector<std::pair<std::string, std::vector<std::byte>>> pictures_;
};

}  // namespace nadir::bench
