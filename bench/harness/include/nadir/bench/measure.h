#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "nadir/base/result.h"

namespace nadir::bench {

/// What running something took.
struct Usage {
  double wall_ms = 0;
  double cpu_ms = 0;                        // of all threads
  std::optional<std::uint64_t> peak_bytes;  // resident; nothing where the system does not tell
};

/// Runs `run` here, `calls` times, and gives what one took: wall and CPU time, no memory.
Result<Usage> measure(const std::function<Result<void>()>& run, int calls = 1);

/// The text that `run` gives in a forked child process, or the child's error: what it does to memory, caches and
/// threads does not stay. Threads of this process are not in the child: one that has started a pool of them (TBB,
/// GDAL) must not run what uses the pool.
Result<std::string> in_child(const std::function<Result<std::string>()>& run);

/// Memory that `run` takes at its peak beyond what was resident before it, found in a forked child. See `in_child`.
/// Error: the kernel's counters lag by up to 64 pages a thread; libraries first used in it count.
Result<std::uint64_t> peak_in_child(const std::function<Result<void>()>& run);

/// Runs a program, found on the PATH, from start to end, its output thrown away. `peak_bytes` is of its whole process
/// and of none that it starts. Error: NotFound where there is no such program, Io with the end of what it told on
/// standard error where it does not exit with 0.
Result<Usage> measure_command(const std::vector<std::string>& command);

}  // namespace nadir::bench
