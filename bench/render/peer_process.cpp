#include "peer_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <sstream>

#include "nadir/base/text.h"

extern char** environ;

namespace nadir::bench {
namespace {

namespace fs = std::filesystem;

fs::path beside_this(const std::string& program) {
  std::error_code problem;
  return fs::read_symlink("/proc/self/exe", problem).parent_path() / program;
}

/// "ok WALL CPU PEAK", or what the peer says instead.
Result<Usage> usage_of(const std::string& name, const std::string& answer) {
  const auto words = split(answer, ' ');
  if (words.size() == 4 && words[0] == "ok") {
    const auto wall = parse_number(words[1]), cpu = parse_number(words[2]), peak = parse_number(words[3]);
    if (wall && cpu && peak) return Usage{*wall, *cpu, static_cast<std::uint64_t>(*peak)};
  }
  return fail(Error::Kind::Io, fmt::format("{}: {}", name, answer.empty() ? "ended without an answer" : answer));
}

}  // namespace

std::vector<std::string> PeerCommand::words() const {
  std::vector<std::string> all = {beside_this(program).string(), method, std::to_string(threads), views.string()};
  all.insert(all.end(), maps.begin(), maps.end());
  return all;
}

std::string why_missing(const std::string& program) {
  const fs::path path = beside_this(program);
  if (::access(path.c_str(), X_OK) == 0) return "";
  return fmt::format("{} was not built, its library is missing (see cmake/setup.sh)", program);
}

Result<std::unique_ptr<PeerProcess>> PeerProcess::start(const PeerCommand& command) {
  std::unique_ptr<PeerProcess> peer(new PeerProcess(command.program + " " + command.method));
  std::array<int, 2> in{}, out{};
  if (::pipe2(in.data(), O_CLOEXEC) != 0) return fail(Error::Kind::Io, std::string("pipe: ") + std::strerror(errno));
  peer->to_peer_ = in[1];
  if (::pipe2(out.data(), O_CLOEXEC) != 0) {
    ::close(in[0]);
    return fail(Error::Kind::Io, std::string("pipe: ") + std::strerror(errno));
  }
  peer->from_peer_ = out[0];
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, in[0], 0);
  ::posix_spawn_file_actions_adddup2(&actions, out[1], 1);
  auto words = command.words();
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const int problem = ::posix_spawn(&peer->process_, argv[0], &actions, nullptr, argv.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(in[0]);
  ::close(out[1]);
  if (problem != 0) {
    peer->process_ = -1;
    return fail(Error::Kind::NotFound, fmt::format("{}: cannot be started: {}", words[0], std::strerror(problem)));
  }
  const auto ready = peer->answer();
  if (!ready) return fail(ready);
  if (*ready != "ready") return fail(Error::Kind::Io, fmt::format("{}: {}", peer->name_, *ready));
  return peer;
}

PeerProcess::~PeerProcess() {
  if (to_peer_ >= 0) ::close(to_peer_);  // it ends where its input does
  if (from_peer_ >= 0) ::close(from_peer_);
  if (process_ > 0)
    while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
    }
}

Result<std::string> PeerProcess::answer() {
  for (;;) {
    if (const std::size_t end = buffer_.find('\n'); end != std::string::npos) {
      std::string line = buffer_.substr(0, end);
      buffer_.erase(0, end + 1);
      return line;
    }
    std::array<char, 4096> block{};
    const ssize_t n = ::read(from_peer_, block.data(), block.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return fail(Error::Kind::Io, name_ + ": ended without an answer");
    buffer_.append(block.data(), static_cast<std::size_t>(n));
  }
}

Result<Usage> PeerProcess::ask(const std::string& line) {
  const std::string text = line + "\n";
  if (::write(to_peer_, text.data(), text.size()) != static_cast<ssize_t>(text.size()))
    return fail(Error::Kind::Io, name_ + ": takes no requests any more");
  const auto said = answer();
  if (!said) return fail(said);
  return usage_of(name_, *said);
}

Result<Usage> PeerProcess::frame(int view) { return ask(fmt::format("frame {}", view)); }

Result<std::string> PeerProcess::samples(const fs::path& folder) {
  const fs::path file = folder / "frame.raw";
  if (const auto written = ask("write " + file.string()); !written) return fail(written);
  std::ifstream in(file, std::ios::binary);
  std::ostringstream bytes;
  bytes << in.rdbuf();
  std::error_code ignored;
  fs::remove(file, ignored);
  return std::move(bytes).str();
}

Result<ColdFrame> cold_frame(const PeerCommand& command, int view) {
  auto words = command.words();
  words.insert(words.end(), {"--once", std::to_string(view)});
  std::string quoted;
  for (const std::string& word : words) quoted += "'" + word + "' ";
  const auto start = std::chrono::steady_clock::now();
  struct Close {
    void operator()(FILE* pipe) const { ::pclose(pipe); }
  };
  std::unique_ptr<FILE, Close> pipe(::popen(("exec " + quoted).c_str(), "r"));
  if (!pipe) return fail(Error::Kind::Io, command.program + ": cannot be started");
  std::string text;
  std::array<char, 4096> block{};
  while (const std::size_t n = std::fread(block.data(), 1, block.size(), pipe.get())) text.append(block.data(), n);
  pipe.reset();  // waits for its end
  const std::chrono::duration<double, std::milli> whole = std::chrono::steady_clock::now() - start;
  const auto usage = usage_of(command.program + " " + command.method, std::string(trim(text)));
  if (!usage) return fail(usage);
  return ColdFrame{*usage, whole.count()};
}

}  // namespace nadir::bench
