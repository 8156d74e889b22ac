#pragma once

#include <sys/types.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "nadir/bench/measure.h"

namespace nadir::bench {

/// What starts a peer: see peers/peer.h.
struct PeerCommand {
  std::string program;  // "nadir-peer-opencv", beside this one
  std::string method;
  int threads = 1;
  std::filesystem::path views;
  std::vector<std::string> maps;

  std::vector<std::string> words() const;
};

/// Why a peer's program cannot take part: empty where it lies beside this one.
std::string why_missing(const std::string& program);

/// A peer that was started and has opened its map. Ends with it.
class PeerProcess {
 public:
  static Result<std::unique_ptr<PeerProcess>> start(const PeerCommand& command);
  ~PeerProcess();
  PeerProcess(const PeerProcess&) = delete;
  PeerProcess& operator=(const PeerProcess&) = delete;

  /// Renders a view of the file; what that took by the peer's own clocks.
  Result<Usage> frame(int view);
  /// The samples of its last frame, by way of a file in `folder`.
  Result<std::string> samples(const std::filesystem::path& folder);

 private:
  explicit PeerProcess(std::string name) : name_(std::move(name)) {}
  Result<Usage> ask(const std::string& line);
  Result<std::string> answer();

  std::string name_, buffer_;
  pid_t process_ = -1;
  int to_peer_ = -1, from_peer_ = -1;
};

/// A peer in a process of its own from start to end: the time from its `main` on until the first frame is there, and
/// that of the whole process.
struct ColdFrame {
  Usage open_and_first;
  double process_ms = 0;
};
Result<ColdFrame> cold_frame(const PeerCommand& command, int view);

}  // namespace nadir::bench
