#include "nadir/record/scratch_dataset.h"

namespace nadir::record {

ScratchDataset::~ScratchDataset() {
  if (!dataset_) return;
  dataset_.reset();  // waits until all is written
  std::error_code error;
  std::filesystem::remove_all(folder_, error);
}

Result<void> ScratchDataset::add(render::Frame frame) {
  if (!dataset_) {
    auto created = Dataset::create(folder_, /*force=*/false);
    if (!created) return fail(created);
    dataset_.emplace(std::move(*created));
  }
  return dataset_->add(std::move(frame), count_++, "tried", /*masks=*/true);
}

}  // namespace nadir::record
