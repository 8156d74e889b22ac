// original_bench [OUT_FOLDER]: the original of 2022, re-enacted beside this renderer. Writes original.md and
// original.png.
#include <fmt/format.h>

#include <cstdlib>
#include <cstring>
#include <fstream>

#include "sections.h"

int main(int argc, char** argv) {
  using namespace nadir::bench;
  if (argc == 6 && std::strcmp(argv[1], "--measure") == 0)
    return measure_cost(argv[2], argv[3], std::atoi(argv[4]), std::atoi(argv[5]));
  if (argc > 2 || (argc == 2 && argv[1][0] == '-')) {
    std::fprintf(stderr, "usage: original_bench [OUT_FOLDER]\n");
    return 2;
  }
  const std::filesystem::path out = argc > 1 ? argv[1] : "build/original", work = out / "maps";
  std::filesystem::create_directories(work);

  std::string page;
  const auto add = [&](const std::string& section) {
    fmt::print("{}\n", section);
    std::fflush(stdout);
    page += section + "\n";
  };
  add(scale_section(work));
  add(aliasing_section(work, out / "original.png"));
  add(cost_section(work));
  add(border_section());
  std::filesystem::remove_all(work);

  std::ofstream file(out / "original.md");
  file << page;
  file.close();
  if (!file) {
    std::fprintf(stderr, "original_bench: %s could not be written\n", (out / "original.md").c_str());
    return 1;
  }
  fmt::print("{}\n{}\n", (out / "original.md").string(), (out / "original.png").string());
}
