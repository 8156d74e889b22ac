#include "peer.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <iostream>
#include <thread>

#include "nadir/base/files.h"

namespace nadir::bench {
namespace {

using Clock = std::chrono::steady_clock;

double cpu_ms() {
  timespec t{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

/// Peak resident memory of this program, without what started it.
std::uint64_t peak_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;)
    if (word == "VmHWM:") {
      std::uint64_t kib = 0;
      status >> kib;
      return kib * 1024;
    }
  return 0;
}

void say(const std::string& line) {
  std::fputs((line + "\n").c_str(), stdout);
  std::fflush(stdout);
}

struct Stopwatch {
  Clock::time_point start = Clock::now();
  double cpu = cpu_ms();
  void tell() const {
    const double wall = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
    say(fmt::format("ok {:.6f} {:.6f} {}", wall, cpu_ms() - cpu, peak_bytes()));
  }
};

Result<void> serve(const Stopwatch& since_start, std::vector<std::string> words, const OpenPeer& open) {
  int once = -1;
  if (words.size() > 2 && words[words.size() - 2] == "--once") {
    once = std::stoi(words.back());
    words.resize(words.size() - 2);
  }
  if (words.size() < 4) return fail(Error::Kind::NotFound, "expected METHOD THREADS VIEWS MAP... [--once VIEW]");
  const auto views = read_views(words[2]);
  if (!views) return fail(views);
  auto peer = open({words[0], std::stoi(words[1]), {words.begin() + 3, words.end()}});
  if (!peer) return fail(peer);
  if (once >= 0) {
    if (const auto done = (*peer)->render(views->at(static_cast<std::size_t>(once))); !done) return fail(done);
    since_start.tell();
    return {};
  }
  say("ready");
  for (std::string line; std::getline(std::cin, line);) {
    if (line.starts_with("frame ")) {
      const View& view = views->at(static_cast<std::size_t>(std::stoi(line.substr(6))));
      const Stopwatch stopwatch;
      if (const auto done = (*peer)->render(view); !done) return fail(done);
      stopwatch.tell();
    } else if (line.starts_with("write ")) {
      const Stopwatch stopwatch;
      const auto bytes = (*peer)->samples();
      const auto written = write_file(line.substr(6), {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
      if (!written) return fail(written);
      stopwatch.tell();
    } else {
      return fail(Error::Kind::NotFound, "what is '" + line + "'?");
    }
  }
  return {};
}

}  // namespace

void in_bands(int height, int bands, int threads, const std::function<void(int band, int first_row, int rows)>& run) {
  const auto part = [&](int thread) {
    for (int band = thread; band < bands; band += threads) {
      const int first = height * band / bands, end = height * (band + 1) / bands;
      if (end > first) run(band, first, end - first);
    }
  };
  std::vector<std::jthread> others;
  for (int thread = 1; thread < threads; ++thread) others.emplace_back(part, thread);
  part(0);
}

int run_peer(int argc, char** argv, const OpenPeer& open) {
  const Stopwatch since_start;
  const auto done = serve(since_start, {argv + 1, argv + argc}, open);
  if (done) return 0;
  say("error " + done.error().message);
  return 1;
}

}  // namespace nadir::bench
