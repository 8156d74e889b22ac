#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "nadir/base/result.h"
#include "view.h"

namespace nadir::bench {

/// What a peer is started with.
struct PeerSetup {
  std::string method;  // which of the program's
  int threads = 1;
  std::vector<std::string> maps;
};

/// A renderer that has opened its map.
class Peer {
 public:
  virtual ~Peer() = default;
  virtual Result<void> render(const View& view) = 0;
  /// The last frame: rows from the top, bands interleaved, of the map's type.
  virtual std::span<const std::byte> samples() const = 0;
};

/// What all caches of decoded tiles may hold, Nadir's as its peers'.
constexpr std::size_t peer_cache_bytes = 256u << 20;

/// Runs `band(first_row, rows)` for `bands` parts of the image's rows, part i on thread i modulo `threads`.
void in_bands(int height, int bands, int threads, const std::function<void(int band, int first_row, int rows)>& run);

using OpenPeer = std::function<Result<std::unique_ptr<Peer>>(const PeerSetup&)>;

/// The program of a peer: PROGRAM METHOD THREADS VIEWS MAP... [--once VIEW].
///
/// Opens the map and says "ready". Then for each line "frame I" on standard input it renders view I and says
/// "ok WALL_MS CPU_MS PEAK_BYTES", and for "write PATH" it writes the last frame. With --once it renders one frame and
/// says what that took since `main`, opening with it. What fails is said as "error ...".
int run_peer(int argc, char** argv, const OpenPeer& open);

}  // namespace nadir::bench
