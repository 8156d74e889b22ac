#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>

namespace nadir {

/// Tells on standard error how far a long job is: a bar with rate and time left on a terminal,
/// elsewhere a line at each tenth. Silent for jobs that end within a second.
/// Thread-safe.
class Progress {
 public:
  /// `what`: "rendering"; `unit`: "frames"; `total` > 0. A disabled one prints nothing.
  Progress(std::string what, std::string unit, std::int64_t total, bool enabled = true);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void advance(std::int64_t steps = 1);

 private:
  void print(bool last);

  std::string what_, unit_;
  std::int64_t total_;
  bool enabled_, terminal_;
  std::mutex mutex_;  // guards what follows
  std::int64_t done_ = 0, printed_tenth_ = 0;
  bool printed_ = false;
  std::chrono::steady_clock::time_point start_, printed_at_;
};

}  // namespace nadir
