#include "endpoint.h"

#include <cstdlib>
#include <string_view>

namespace nadir::transfer {

Counters Tally::now() const { return {requests, bytes, retries, cache_hits, cache_failures}; }

Tally& process_tally() {
  static Tally tally;
  return tally;
}

Counters process_counters() { return process_tally().now(); }

void Endpoint::count(std::atomic<std::uint64_t> Tally::*what, std::uint64_t n) const {
  tally.*what += n;
  process_tally().*what += n;
}

bool is_offline(const TransferOptions& options) {
  const char* const value = std::getenv("NADIR_OFFLINE");
  return options.offline || (value && *value && std::string_view(value) != "0");
}

}  // namespace nadir::transfer
