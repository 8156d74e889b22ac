#pragma once

#include <cstddef>
#include <deque>
#include <vector>

#include "nadir/render/time_budget.h"

namespace nadir::render {

/// Chooses a way of sampling for each frame from how long the frames before took. What it chooses depends on the
/// machine and its moment: frames are no longer the same bytes in each run, and their records say so. It reads no
/// clock: times are told.
///
/// A frame over the budget leads down at once, to the finest way expected to keep it; a second one in a row, to the
/// cheapest. It goes up by one way at a time, after some frames in time, if the next finer way is expected to keep the
/// budget with a margin; what that costs more is learned each time. After a way up that was a mistake, the next
/// attempt waits twice as long. One thread at a time.
class AdaptiveQuality {
 public:
  /// Begins with what was fitted, and with the ratios of times that were measured.
  explicit AdaptiveQuality(const FittedQuality& fitted);

  /// The options for the next frame, declared as adaptive.
  RenderOptions options(RenderOptions others) const;
  std::size_t rung() const { return rung_; }  // in quality_ladder()

  /// What a frame with these options took, >= 0.
  void note(double frame_ms);

 private:
  void go_to(std::size_t rung);
  void go_down(double frame_ms);
  void learn(double frame_ms);

  double budget_ms_;
  std::vector<double> ratio_;  // [k]: time of way k + 1 over that of way k, >= 1
  std::size_t rung_;
  std::deque<double> recent_;  // times at this rung, the last ones
  int frames_here_ = 0;
  int wait_;              // frames at a rung before the next one up is tried
  double before_ms_ = 0;  // typical at the rung below, where this one was reached from there; else 0
  bool late_ = false;     // the frame before was over the budget
};

}  // namespace nadir::render
