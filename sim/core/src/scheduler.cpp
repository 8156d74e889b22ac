#include "nadir/sim/scheduler.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <queue>
#include <thread>
#include <tuple>

#include "nadir/base/text.h"

namespace nadir::sim {

Result<Rate> Rate::parse_hz(std::string_view text) {
  // As seconds are parsed, so that no digit is lost: 29.97 "seconds" are 29970000000 billionths of a sample a second.
  const auto billionths = parse_seconds_as_ns(text);
  constexpr std::int64_t most_hz = 1'000'000;
  if (!billionths || *billionths < 1000 || *billionths > most_hz * 1'000'000'000 || *billionths % 1000 != 0)
    return fail(
        Error::Kind::Malformed,
        fmt::format("'{}': expected a rate from 0.000001 to {} Hz with at most six decimals", trim(text), most_hz));
  return Rate{*billionths / 1000, 1'000'000'000'000'000};  // millionths of a Hz are samples in a million seconds
}

std::int64_t Rate::time_ns(std::int64_t k) const {
  return static_cast<std::int64_t>(static_cast<__int128>(k) * nanoseconds / samples);
}

void Scheduler::add(Stage stage, const Rate& rate, Task task) { parts_.push_back({stage, rate, std::move(task)}); }

Result<void> Scheduler::run(std::int64_t end_ns, double pace) {
  end_ns_ = end_ns;
  struct Next {
    std::int64_t time_ns;
    Stage stage;
    std::size_t part;
    std::int64_t sample;
    bool operator>(const Next& other) const {
      return std::tie(time_ns, stage, part) > std::tie(other.time_ns, other.stage, other.part);
    }
  };
  std::priority_queue<Next, std::vector<Next>, std::greater<>> queue;
  for (std::size_t i = 0; i < parts_.size(); ++i) queue.push({0, parts_[i].stage, i, 0});

  const auto start = std::chrono::steady_clock::now();
  while (!queue.empty()) {
    Next next = queue.top();
    queue.pop();
    const Part& part = parts_[next.part];
    if (next.time_ns > end_ns_ || (part.stage == Stage::Move && next.time_ns == end_ns_)) continue;
    if (pace > 0)
      std::this_thread::sleep_until(start +
                                    std::chrono::nanoseconds(std::llround(static_cast<double>(next.time_ns) / pace)));
    if (auto done = part.task(next.time_ns); !done) return done;
    ++next.sample;
    next.time_ns = part.rate.time_ns(next.sample);
    queue.push(next);
  }
  return {};
}

}  // namespace nadir::sim
