#include "nadir/render/adaptive_quality.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace nadir::render {
namespace {

/// Part of the budget that an expected time may take: times of like frames differ by a tenth and more.
constexpr double margin = 0.85;
constexpr int shortest_wait = 8, longest_wait = 512;  // frames

/// Of their samples, of footprints that are square: what a way of sampling takes more than another at most, since the
/// rest of a frame's work is the same.
double ratio_of_samples(const Rung& finer, const Rung& coarser) {
  const double across = std::ceil(finer.oversampling.value_or(1)), before = std::ceil(coarser.oversampling.value_or(1));
  return across * across / (before * before);
}

}  // namespace

AdaptiveQuality::AdaptiveQuality(const FittedQuality& fitted)
    : budget_ms_(fitted.budget_ms), rung_(fitted.rung), wait_(shortest_wait) {
  const auto ladder = quality_ladder();
  for (std::size_t k = 0; k + 1 < ladder.size(); ++k) {
    const bool measured = k + 1 < fitted.measured_ms.size() && fitted.measured_ms[k] > 0;
    ratio_.push_back(measured ? std::max(1.0, fitted.measured_ms[k + 1] / fitted.measured_ms[k])
                              : ratio_of_samples(ladder[k + 1], ladder[k]));
  }
}

RenderOptions AdaptiveQuality::options(RenderOptions others) const {
  others.adaptive = true;
  return with_rung(std::move(others), quality_ladder()[rung_]);
}

void AdaptiveQuality::note(double frame_ms) {
  assert(frame_ms >= 0);
  if (frames_here_ == 0 && before_ms_ > 0) learn(frame_ms);
  ++frames_here_;
  recent_.push_back(frame_ms);
  if (recent_.size() > static_cast<std::size_t>(shortest_wait)) recent_.pop_front();
  if (frame_ms > budget_ms_) return go_down(frame_ms);
  late_ = false;
  if (frames_here_ < wait_) return;
  if (before_ms_ > 0) {  // the way up was right
    before_ms_ = 0;
    wait_ = shortest_wait;
  }
  if (rung_ == ratio_.size()) return;
  if (*std::max_element(recent_.begin(), recent_.end()) * ratio_[rung_] > margin * budget_ms_) return;
  std::vector<double> sorted(recent_.begin(), recent_.end());
  std::sort(sorted.begin(), sorted.end());
  go_to(rung_ + 1);
  before_ms_ = sorted[sorted.size() / 2];
}

void AdaptiveQuality::go_down(double frame_ms) {
  const bool mistaken = before_ms_ > 0;
  if (mistaken) wait_ = std::min(2 * wait_, longest_wait);
  std::size_t to = rung_;
  double expected_ms = frame_ms;
  while (to > 0 && expected_ms > margin * budget_ms_) expected_ms /= ratio_[--to];
  go_to(late_ ? 0 : to);
  late_ = true;
}

/// Half of what is new, and no more than half as much again: one frame may be slow for other reasons.
void AdaptiveQuality::learn(double frame_ms) {
  double& ratio = ratio_[rung_ - 1];
  const double found = std::clamp(frame_ms / before_ms_, ratio / 1.5, ratio * 1.5);
  ratio = std::max(1.0, (ratio + found) / 2);
}

void AdaptiveQuality::go_to(std::size_t rung) {
  rung_ = rung;
  recent_.clear();
  frames_here_ = 0;
  before_ms_ = 0;
}

}  // namespace nadir::render
