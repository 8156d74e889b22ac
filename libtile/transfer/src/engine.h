#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "endpoint.h"
#include "http.h"

namespace nadir::transfer {

class Batch;

/// What an exchange makes of what the server said.
enum class Verdict {
  Proceed,  // all well so far; at the end: done
  Again,    // at once: the next request will be another
  Broken,   // as after a lost connection: later
  Failed,   // `error` says why
};

/// What is sent, in one try.
struct Outgoing {
  std::string method = "GET";
  std::vector<std::string> headers;
  std::string range;        // "0-99"; empty: all
  std::string_view body;    // lives as long as the exchange
  bool compressed = false;  // may come compressed
};

/// One request and its answer, over as many tries as it takes. The engine calls it from its own thread until it is
/// done; then it belongs to whoever takes it from its batch.
class Exchange {
 public:
  Exchange(std::shared_ptr<const Endpoint> to, std::shared_ptr<Batch> batch)
      : endpoint(std::move(to)), batch_(std::move(batch)) {}
  virtual ~Exchange() = default;

  virtual Outgoing next_try() = 0;
  /// The head of an answer that is none of `is_passing`, before its body.
  virtual Verdict head(const Head& head) = 0;
  virtual Verdict bytes(std::span<const std::byte> bytes) = 0;
  virtual Verdict end() = 0;

  const std::shared_ptr<const Endpoint> endpoint;
  std::optional<Error> error;  // of the exchange as a whole, once it is done

 private:
  friend class Engine;
  const std::shared_ptr<Batch> batch_;
  int tries_ = 0;
  std::chrono::steady_clock::time_point not_before_{};
};

/// Exchanges that one caller waits for, in the order in which they end.
/// Thread-safe.
class Batch {
 public:
  /// The next exchange that ended. To be called once for each that was submitted.
  std::shared_ptr<Exchange> next();

 private:
  friend class Engine;
  friend void cancel(Batch& batch);
  void add(std::shared_ptr<Exchange> exchange);

  std::atomic<bool> cancelled_{false};
  std::mutex mutex_;  // guards ended_
  std::condition_variable something_ended_;
  std::deque<std::shared_ptr<Exchange>> ended_;
};

/// Hands `exchanges` to the thread that runs all transfers of this process, so that connections are shared and kept.
/// Requests to one host start in the order of submission, as many at a time as the options allow, and wait together
/// when the host is overloaded. Unsupported where libcurl is missing. Thread-safe.
Result<void> submit(std::span<const std::shared_ptr<Exchange>> exchanges);

/// Drops what of `batch` has not ended: it never comes.
void cancel(Batch& batch);

}  // namespace nadir::transfer
