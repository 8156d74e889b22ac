#pragma once

#include <cmath>
#include <cstdint>

namespace nadir {

/// For arithmetic and for people: the nearest number of seconds. Times themselves stay whole nanoseconds.
constexpr double seconds_from_ns(std::int64_t time_ns) { return static_cast<double>(time_ns) / 1e9; }
inline std::int64_t ns_from_seconds(double time_s) { return std::llround(time_s * 1e9); }

}  // namespace nadir
