// `nadir X ...` runs the program nadir-X that lies beside this one, so that each starts with only what it needs.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "nadir/base/text.h"

namespace {
namespace fs = std::filesystem;

const std::map<std::string, std::string> summaries = {
    {"bench", "measure time, error and memory of methods; tables, pictures and a report"},
    {"build", "make a map: a cloud-optimized pyramid from rasters or tiles"},
    {"doctor", "look at a run before it runs: maps, datum, resolution, memory, time"},
    {"fly", "the whole simulator: vehicles fly, cameras render, a dataset and a report are left"},
    {"info", "say what a map is: size, levels, CRS, bands, what to mind"},
    {"verify", "check a dataset: recompute its truth, render random frames again"},
    {"render", "camera frames and ground truth for given poses"},
};

std::map<std::string, fs::path> programs_beside(const fs::path& self) {
  std::map<std::string, fs::path> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(self.parent_path(), error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("nadir-") && ::access(entry.path().c_str(), X_OK) == 0 && entry.is_regular_file(error))
      found[name.substr(6)] = entry.path();
  }
  return found;
}

void print_help(const std::map<std::string, fs::path>& programs) {
  fmt::print(
      "Nadir {}: camera frames of real maps, with exact ground truth\n\nusage: nadir COMMAND ...   (nadir COMMAND "
      "--help for its options)\n\ncommands:\n",
      NADIR_VERSION);
  for (const auto& [name, path] : programs) {
    const auto summary = summaries.find(name);
    if (summary != summaries.end()) fmt::print("  {:<10} {}\n", name, summary->second);
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  const auto programs = programs_beside(self);
  const std::string command = argc > 1 ? argv[1] : "help";
  if (command == "help" || command == "--help" || command == "-h") {
    print_help(programs);
    return argc > 1 ? 0 : 2;
  }
  if (command == "--version" || command == "version") {
    fmt::print("nadir {}\n", NADIR_VERSION);
    return 0;
  }
  const auto program = programs.find(command);
  if (program == programs.end()) {
    std::vector<std::string_view> known;
    for (const auto& [name, path] : programs) known.push_back(name);
    fmt::print(stderr, "nadir: unknown command '{}'{}\n", command, nadir::suggestion(command, known));
    return 2;
  }
  ::execv(program->second.c_str(), argv + 1);
  fmt::print(stderr, "nadir: {} cannot be run: {}\n", program->second.string(), std::strerror(errno));
  return 1;
}
