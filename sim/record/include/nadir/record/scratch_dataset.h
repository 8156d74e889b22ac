#pragma once

#include <filesystem>
#include <optional>

#include "nadir/record/dataset.h"

namespace nadir::record {

/// Writes frames as a dataset's are written, beside the making of the next one, and in the end removes them: the load
/// under which frames will be made, for when it is tried how long they take. One thread at a time.
class ScratchDataset {
 public:
  /// In a folder of its own in `folder`.
  explicit ScratchDataset(const std::filesystem::path& folder) : folder_(folder / "tried_frames") {}
  ScratchDataset(const ScratchDataset&) = delete;
  ScratchDataset& operator=(const ScratchDataset&) = delete;
  ~ScratchDataset();

  Result<void> add(render::Frame frame);

 private:
  const std::filesystem::path folder_;
  std::optional<Dataset> dataset_;  // from the first frame on
  std::int64_t count_ = 0;
};

}  // namespace nadir::record
