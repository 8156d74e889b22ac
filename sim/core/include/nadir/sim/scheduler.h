#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "nadir/base/result.h"

namespace nadir::sim {

/// A rate as an exact fraction of samples a second, so that the thousandth sample of 30 Hz is where it should be.
struct Rate {
  std::int64_t samples = 1, nanoseconds = 1'000'000'000;  // so many samples in so many nanoseconds; both positive

  /// From decimal text: "10", "0.5", "29.97". At most six decimals; from 1e-6 to 1e6 Hz.
  static Result<Rate> parse_hz(std::string_view text);
  /// Time of the k-th sample, the first (k = 0) at 0, rounded down to a nanosecond.
  std::int64_t time_ns(std::int64_t k) const;
  double hz() const { return static_cast<double>(samples) * 1e9 / static_cast<double>(nanoseconds); }
};

/// Runs parts of a simulation, each at its own rate, in lock step on one clock of whole nanoseconds.
///
/// What falls on one instant runs in the order of `Stage`, then in the order of addition: the same sequence in every
/// run. Nothing here reads a clock of the machine, but for pacing, which delays and decides nothing. One thread at a
/// time.
class Scheduler {
 public:
  /// What happens at one instant: first decisions on what is known, then observations, then motion on to the next.
  enum class Stage { Decide, Observe, Move };
  using Task = std::function<Result<void>(std::int64_t time_ns)>;

  void add(Stage stage, const Rate& rate, Task task);

  /// Nothing later than this happens any more: for a part that has come to its end.
  void end_at(std::int64_t time_ns) { end_ns_ = std::min(end_ns_, time_ns); }
  /// The time it ran to.
  std::int64_t end_ns() const { return end_ns_; }

  /// Runs all samples with time in [0, end]; Move ones in [0, end). Stops at the first failure.
  /// `pace`: simulated seconds a second of the machine's; 0: as fast as possible.
  Result<void> run(std::int64_t end_ns, double pace = 0);

 private:
  struct Part {
    Stage stage;
    Rate rate;
    Task task;
  };
  std::vector<Part> parts_;
  std::int64_t end_ns_ = 0;
};

}  // namespace nadir::sim
