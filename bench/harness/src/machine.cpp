#include "nadir/bench/machine.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/utsname.h>

#include <cstdio>
#include <ctime>
#include <fstream>
#include <memory>
#include <thread>

#include "nadir/base/text.h"

namespace nadir::bench {
namespace {

#ifdef __clang__
constexpr auto compiler = __VERSION__;  // names itself
#else
constexpr auto compiler = "GCC " __VERSION__;
#endif

/// The value behind "key   : value" in a file of /proc.
std::string proc_value(const char* file, std::string_view key) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);)
    if (line.starts_with(key))
      if (const std::size_t colon = line.find(':'); colon != std::string::npos)
        return std::string(trim(std::string_view(line).substr(colon + 1)));
  return "unknown";
}

std::string output_of(const char* shell_command) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(::popen(shell_command, "r"), ::pclose);
  std::string text;
  char block[256];
  while (pipe && std::fgets(block, sizeof block, pipe.get())) text += block;
  return std::string(trim(text));
}

std::string memory() {
  const std::string kib = proc_value("/proc/meminfo", "MemTotal");
  const auto value = parse_number(split(kib, ' ').front());
  return value ? format_bytes(static_cast<std::uint64_t>(*value) * 1024) : kib;
}

}  // namespace

const std::string& commit() {
  static const std::string text = [] {
    const std::string described = output_of("git -C '" NADIR_SOURCE_DIR "' describe --always --dirty 2>/dev/null");
    return described.empty() ? std::string(NADIR_VERSION) : described;
  }();
  return text;
}

std::vector<std::pair<std::string, std::string>> machine() {
  utsname system{};
  ::uname(&system);
  return {{"CPU", proc_value("/proc/cpuinfo", "model name")},
          {"cores", std::to_string(std::thread::hardware_concurrency())},
          {"memory", memory()},
          {"kernel", fmt::format("{} {} {}", system.sysname, system.release, system.machine)},
          {"compiler", compiler},
          {"commit", commit()},
          {"date", fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(std::time(nullptr)))}};
}

}  // namespace nadir::bench
