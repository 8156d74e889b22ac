#pragma once

#include <atomic>
#include <cstdint>

#include "nadir/transfer/options.h"
#include "target.h"

namespace nadir::transfer {

/// Counters that several threads count in.
struct Tally {
  std::atomic<std::uint64_t> requests{0}, bytes{0}, retries{0}, cache_hits{0}, cache_failures{0};
  Counters now() const;
};

/// Of the whole process.
Tally& process_tally();

/// Where requests go, how patient they are and who counts them: shared by all requests of one file.
struct Endpoint {
  Target target;
  TransferOptions options;
  mutable Tally tally;

  /// Counts `n` here and for the process.
  void count(std::atomic<std::uint64_t> Tally::*what, std::uint64_t n = 1) const;
};

/// Whether nothing may be asked of the network: by the options or by NADIR_OFFLINE.
bool is_offline(const TransferOptions& options);

}  // namespace nadir::transfer
