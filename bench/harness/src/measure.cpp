#include "nadir/bench/measure.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <malloc.h>
#include <sys/mman.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <cassert>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "nadir/base/text.h"

namespace nadir::bench {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

double process_cpu_ms() {
  timespec t{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

double ms(const timeval& t) { return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_usec) * 1e-3; }

/// A line of /proc/PID/status: "VmHWM:     1234 kB".
std::optional<std::uint64_t> status_bytes(const std::string& pid, std::string_view key) {
  std::ifstream status("/proc/" + pid + "/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with(key) && line.ends_with(" kB"))
      if (const auto kib = parse_number(std::string_view(line).substr(key.size() + 1, line.size() - key.size() - 4)))
        return static_cast<std::uint64_t>(*kib) * 1024;
  return std::nullopt;
}

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }
  void close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }

 private:
  int fd_;
};

std::string read_all(int fd) {
  std::string text;
  char block[1 << 14];
  for (;;) {
    const ssize_t n = ::read(fd, block, sizeof block);
    if (n > 0)
      text.append(block, static_cast<std::size_t>(n));
    else if (n == 0 || errno != EINTR)
      return text;
  }
}

void write_all(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = ::write(fd, text.data(), text.size());
    if (n < 0 && errno != EINTR) return;
    if (n > 0) text.remove_prefix(static_cast<std::size_t>(n));
  }
}

std::string how_it_ended(int status) {
  if (WIFSIGNALED(status))
    return fmt::format("was ended by signal {} ({})", WTERMSIG(status), ::strsignal(WTERMSIG(status)));
  return fmt::format("exited with {}", WEXITSTATUS(status));
}

/// The end of what a program told, on one line.
std::string last_words(int fd) {
  ::lseek(fd, 0, SEEK_SET);
  const std::string text = read_all(fd);
  std::string_view end = trim(text);
  if (end.size() > 400) end.remove_prefix(end.size() - 400);
  return end.empty() ? "" : fmt::format(": {}", end);
}

}  // namespace

Result<Usage> measure(const std::function<Result<void>()>& run, int calls) {
  assert(calls > 0);
  const double cpu_before = process_cpu_ms();
  const auto start = Clock::now();
  for (int i = 0; i < calls; ++i)
    if (const auto done = run(); !done) return fail(done);
  const double wall = ms_since(start), cpu = process_cpu_ms() - cpu_before;
  return Usage{wall / calls, cpu / calls, std::nullopt};
}

Result<std::string> in_child(const std::function<Result<std::string>()>& run) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return fail(Error::Kind::Io, fmt::format("pipe: {}", std::strerror(errno)));
  Descriptor from_child(ends[0]), to_parent(ends[1]);
  std::fflush(nullptr);  // or the child would print it again
  const pid_t child = ::fork();
  if (child < 0) return fail(Error::Kind::Io, fmt::format("fork: {}", std::strerror(errno)));
  if (child == 0) {
    // The first byte tells text from error, whose kind is the second.
    try {
      const auto text = run();
      write_all(to_parent.get(),
                text ? "+" + *text
                     : fmt::format("-{}{}", static_cast<char>('0' + static_cast<int>(text.error().kind)),
                                   text.error().message));
    } catch (const std::exception& e) {
      write_all(to_parent.get(),
                fmt::format("-{}{}", static_cast<char>('0' + static_cast<int>(Error::Kind::Io)), e.what()));
    }
    std::fflush(nullptr);
    ::_exit(0);  // what was registered to run at exit belongs to the parent
  }
  to_parent.close();
  const std::string told = read_all(from_child.get());
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (told.starts_with('+')) return told.substr(1);
  if (told.size() >= 2) return fail(static_cast<Error::Kind>(told[1] - '0'), told.substr(2));
  return fail(Error::Kind::Io, fmt::format("the child process {} without a result", how_it_ended(status)));
}

Result<std::uint64_t> peak_in_child(const std::function<Result<void>()>& run) {
  const auto bytes = in_child([&]() -> Result<std::string> {
    ::malloc_trim(0);                             // what the parent freed would else be taken again unseen
    std::ofstream("/proc/self/clear_refs") << 5;  // the peak becomes what is resident now
    const auto before = status_bytes("self", "VmRSS");
    if (const auto done = run(); !done) return fail(done);
    const auto peak = status_bytes("self", "VmHWM");
    if (!before || !peak) return fail(Error::Kind::Unsupported, "/proc/self/status tells no VmRSS and VmHWM");
    return std::to_string(*peak > *before ? *peak - *before : 0);
  });
  if (!bytes) return fail(bytes);
  return static_cast<std::uint64_t>(std::stoull(*bytes));
}

Result<Usage> measure_command(const std::vector<std::string>& command) {
  assert(!command.empty());
  std::vector<char*> argv;
  for (const std::string& word : command) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  const Descriptor errors(::memfd_create("stderr", MFD_CLOEXEC));
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0)
    return fail(Error::Kind::Io, fmt::format("{}: cannot be started: {}", command[0], std::strerror(errno)));
  const Descriptor problems(ends[0]);  // the child's errno, where it could not start the program
  Descriptor told(ends[1]);

  // The usage that wait4 gives begins with the peak of the process that started it: Linux counts the memory that exec
  // leaves behind. So we stop the program where it is about to exit and look at its own peak. It waits for us before it
  // starts: a short one could end before we see to it.
  const pid_t child = ::fork();
  if (child == 0) {  // nothing but system calls from here on
    ::dup2(::open("/dev/null", O_RDONLY), 0);
    ::dup2(::open("/dev/null", O_WRONLY), 1);
    ::dup2(errors.get(), 2);
    if (::ptrace(PTRACE_TRACEME, 0, nullptr, nullptr) == 0) ::raise(SIGSTOP);
    ::execvp(argv[0], argv.data());
    const int problem = errno;
    [[maybe_unused]] const auto written = ::write(told.get(), &problem, sizeof problem);
    ::_exit(127);
  }
  if (child < 0)
    return fail(Error::Kind::Io, fmt::format("{}: cannot be started: {}", command[0], std::strerror(errno)));
  told.close();

  auto start = Clock::now();
  bool begun = false;
  Usage usage;
  int status = 0;
  rusage resources{};
  for (;;) {
    if (::wait4(child, &status, __WALL, &resources) < 0) {
      if (errno == EINTR) continue;
      return fail(Error::Kind::Io, fmt::format("{}: cannot be waited for: {}", command[0], std::strerror(errno)));
    }
    if (!WIFSTOPPED(status)) break;
    if (!begun) {
      begun = true;
      ::ptrace(PTRACE_SETOPTIONS, child, nullptr, PTRACE_O_TRACEEXEC | PTRACE_O_TRACEEXIT);
      start = Clock::now();
      ::ptrace(PTRACE_CONT, child, nullptr, 0);
      continue;
    }
    const int event = status >> 16;
    if (event == PTRACE_EVENT_EXIT) usage.peak_bytes = status_bytes(std::to_string(child), "VmHWM");
    ::ptrace(PTRACE_CONT, child, nullptr, event != 0 ? 0 : WSTOPSIG(status));
  }
  usage.wall_ms = ms_since(start);
  usage.cpu_ms = ms(resources.ru_utime) + ms(resources.ru_stime);
  int problem = 0;
  if (::read(problems.get(), &problem, sizeof problem) == sizeof problem)
    return fail(problem == ENOENT ? Error::Kind::NotFound : Error::Kind::Io,
                fmt::format("{}: cannot be started: {}", command[0], std::strerror(problem)));
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    return fail(Error::Kind::Io,
                fmt::format("`{}` {}{}", fmt::join(command, " "), how_it_ended(status), last_words(errors.get())));
  return usage;
}

}  // namespace nadir::bench
