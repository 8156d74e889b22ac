#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace nadir::transfer {

/// How files are fetched, kept and retried. What is here decides cost, never what the bytes are.
struct TransferOptions {
  /// First bytes of a file that opening brings along: the header of a cloud-optimized GeoTIFF. With a cache, whole
  /// blocks.
  std::uint64_t ingest_bytes = 32 << 10;
  /// Ranges at most this far apart become one request: the bytes between cost less than another journey.
  std::uint64_t merge_gap_bytes = 32 << 10;
  /// The most that one request asks for. Several small ones travel side by side, and a broken one loses less.
  std::uint64_t max_request_bytes = 8 << 20;
  /// Requests under way to one host at a time, > 0: connections with HTTP/1.1, streams of one with HTTP/2.
  int connections = 8;

  /// Tries of a request until it counts as failed, the first included, > 0.
  int tries = 5;
  /// Before try n+1 a random time between 0 and min(cap, base 2^(n-1)) passes ("full jitter": Brooker, Exponential
  /// Backoff And Jitter, AWS Architecture Blog, 2015), or what the server's Retry-After asks for, where that is longer.
  double backoff_base_s = 0.5;
  double backoff_cap_s = 30.0;
  /// A Retry-After beyond this is an error that says when to come back.
  double retry_after_limit_s = 120.0;
  double connect_timeout_s = 10.0;
  /// A try that stays slower than so much for so long is broken off. The wait for a server's first byte counts.
  std::uint64_t low_speed_bytes_per_s = 1024;
  int low_speed_s = 15;

  /// Where blocks of files are kept; empty: $XDG_CACHE_HOME/nadir, else ~/.cache/nadir.
  std::filesystem::path cache_dir;
  /// What may be kept there; the least recently used goes first. 0: nothing is kept and nothing looked up.
  std::uint64_t cache_bytes = std::uint64_t{2} << 30;
  /// Nothing is asked of the network: what the cache does not hold is an Error. So does NADIR_OFFLINE=1 in the
  /// environment.
  bool offline = false;

  /// Further lines for every request, "Name: value". Authorization and Cookie stay with the first host when it
  /// redirects; others go along.
  std::vector<std::string> headers;
};

/// What transfers have cost so far.
struct Counters {
  std::uint64_t requests = 0;    // sent, each try counts
  std::uint64_t bytes = 0;       // of bodies that arrived, wanted or not
  std::uint64_t retries = 0;     // tries after the first
  std::uint64_t cache_hits = 0;  // blocks that came from the disk
  std::uint64_t cache_failures =
      0;  // blocks that could not be kept: disk full, folder read-only. Caching stops at the first
};

/// Of all transfers of this process. Thread-safe.
Counters process_counters();

}  // namespace nadir::transfer
