#include "nadir/base/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace nadir {
using Clock = std::chrono::steady_clock;

Progress::Progress(std::string what, std::string unit, std::int64_t total, bool enabled)
    : what_(std::move(what)),
      unit_(std::move(unit)),
      total_(std::max<std::int64_t>(total, 1)),
      enabled_(enabled),
      terminal_(::isatty(STDERR_FILENO) == 1),
      start_(Clock::now()),
      printed_at_(start_) {}

Progress::~Progress() {
  if (printed_) print(/*last=*/true);
}

void Progress::advance(std::int64_t steps) {
  std::scoped_lock lock(mutex_);
  done_ += steps;
  if (!enabled_ || done_ >= total_) return;
  const auto now = Clock::now();
  const std::int64_t tenth = done_ * 10 / total_;
  const bool due = terminal_ ? now - printed_at_ > std::chrono::milliseconds(100) : tenth > printed_tenth_;
  if (!due || now - start_ < std::chrono::seconds(1)) return;
  printed_at_ = now;
  printed_tenth_ = tenth;
  print(/*last=*/false);
}

void Progress::print(bool last) {
  const double seconds = std::chrono::duration<double>(Clock::now() - start_).count();
  const double rate = seconds > 0 ? static_cast<double>(done_) / seconds : 0;
  std::string line = fmt::format("{} {}/{} {}, {:.1f}/s", what_, done_, total_, unit_, rate);
  if (!last && rate > 0) line += fmt::format(", {:.0f} s left", static_cast<double>(total_ - done_) / rate);
  if (terminal_) {
    constexpr int width = 28;
    const int filled = static_cast<int>(done_ * width / total_);
    fmt::print(stderr, "\r[{:#<{}}{:.<{}}] {}\x1b[K{}", "", filled, "", width - filled, line, last ? "\n" : "");
  } else {
    fmt::print(stderr, "{}\n", line);
  }
  std::fflush(stderr);
  printed_ = true;
}

}  // namespace nadir
