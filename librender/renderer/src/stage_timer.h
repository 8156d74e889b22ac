#pragma once

#include <chrono>

namespace nadir::render {

/// Adds the time of its life to a stage's.
class StageTimer {
 public:
  explicit StageTimer(double& stage_ms) : stage_ms_(stage_ms) {}
  ~StageTimer() {
    stage_ms_ += std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count();
  }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  double& stage_ms_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// What `work` gives, its time added to a stage's.
template <class Work>
auto timed(double& stage_ms, Work&& work) {
  const StageTimer timer(stage_ms);
  return work();
}

}  // namespace nadir::render
