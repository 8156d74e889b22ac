// nadir bench: how long methods take, how far they err, what memory they need.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "command.h"
#include "nadir/base/files.h"
#include "nadir/base/progress.h"
#include "nadir/base/text.h"
#include "nadir/bench/machine.h"
#include "nadir/bench/report.h"
#include "suites.h"

namespace {
using namespace nadir;
namespace fs = std::filesystem;

constexpr auto description =
    "Measures a suite: all methods of a case take turns, and each gets its median time, error and peak memory.\n"
    "With -o it leaves results.csv, pictures and report.html. `nadir bench report CSV...` draws results again.\n"
    "A missed aim is told, and is no failure.";

constexpr auto examples =
    "Examples:\n"
    "  nadir bench --list                                  suites\n"
    "  nadir bench start -o start_results                  measure and draw\n"
    "  nadir bench start --quick --case map                only cases with 'map' in their name, in a few rounds\n"
    "  nadir bench report a/results.csv b/results.csv -o both";

/// A folder for what suites write, gone with it.
class ScratchFolder {
 public:
  static Result<ScratchFolder> make() {
    std::string path = (fs::temp_directory_path() / "nadir-bench-XXXXXX").string();
    if (!::mkdtemp(path.data())) return fail(Error::Kind::Io, path + ": cannot be made; is TMPDIR writable?");
    return ScratchFolder(path);
  }
  ScratchFolder(ScratchFolder&& other) noexcept : path_(std::exchange(other.path_, "")) {}
  ~ScratchFolder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  const std::string& path() const { return path_; }

 private:
  explicit ScratchFolder(std::string path) : path_(std::move(path)) {}
  std::string path_;
};

void print_json(const std::vector<bench::Row>& rows) {
  auto json = nlohmann::ordered_json::array();
  for (const bench::Row& row : rows) {
    nlohmann::ordered_json one = {
        {"suite", row.suite}, {"case", row.case_name}, {"method", row.method}, {"setting", row.setting}};
    if (row.error) one["error"] = *row.error;
    if (!row.error_unit.empty()) one["error_unit"] = row.error_unit;
    if (row.cpu_ms) one["cpu_ms"] = *row.cpu_ms;
    if (row.wall_ms) one["wall_ms"] = *row.wall_ms;
    if (row.peak_bytes) one["peak_bytes"] = *row.peak_bytes;
    one["counters"] = row.counters;
    one["commit"] = row.commit;
    json.push_back(std::move(one));
  }
  fmt::print("{}\n", json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

void print_list() {
  for (const bench::Suite& suite : bench::all_suites()) {
    fmt::print("{:<12} {}\n", suite.name, suite.summary);
    for (const bench::Case& one : suite.cases({})) fmt::print("  {}\n", one.name);
  }
}

Result<bench::Suite> find_suite(const std::string& name) {
  const auto suites = bench::all_suites();
  std::vector<std::string_view> names = {"report"};
  for (const bench::Suite& suite : suites) {
    if (suite.name == name) return suite;
    names.push_back(suite.name);
  }
  return fail(Error::Kind::NotFound, fmt::format("no suite '{}'{}", name, suggestion(name, names)));
}

/// The rows of all cases that could be measured, and what went wrong with the others.
struct Measured {
  std::vector<bench::Row> rows;
  std::string faults;
};

Result<Measured> measure(const bench::Suite& suite, const std::string& pattern, bench::RunOptions options) {
  const auto scratch = ScratchFolder::make();
  if (!scratch) return fail(scratch);
  options.scratch = scratch->path();
  auto cases = suite.cases(options);
  std::erase_if(cases, [&](const bench::Case& one) { return one.name.find(pattern) == std::string::npos; });
  if (cases.empty())
    return fail(Error::Kind::NotFound,
                fmt::format("{}: no case has '{}' in its name; `nadir bench --list` tells them", suite.name, pattern));
  Measured measured;
  Progress progress("measuring", "cases", static_cast<std::int64_t>(cases.size()));
  for (const bench::Case& one : cases) {
    const auto rows = bench::run_case(suite.name, one, options);
    const auto add_fault = [&](const std::string& what) {
      measured.faults += fmt::format("{}{}: {}", measured.faults.empty() ? "" : "; ", suite.name, what);
    };
    if (!rows) add_fault(rows.error().message);
    for (const bench::Row& row : rows.value_or(std::vector<bench::Row>{})) {
      if (const auto fault = row.counters.find("fault"); fault != row.counters.end())
        add_fault(fmt::format("{}: {}: {}", one.name, bench::label(row.method, row.setting), fault->second));
      measured.rows.push_back(row);
    }
    progress.advance();
  }
  return measured;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> words;
  std::string output, pattern;
  bench::RunOptions options;
  bool quick = false, json = false, list = false, force = false;

  CLI::App command(description, "nadir bench");
  command.footer(examples);
  command.add_option("SUITE", words, "what to measure; or `report` and files of results")->type_name("");
  command.add_option("-o,--output", output, "folder for results.csv, pictures and report.html")->type_name("DIR");
  command.add_option("--rounds,--repeat", options.rounds, "of each case; else as many as 10 s allow, from 3 to 51")
      ->type_name("N")
      ->check(CLI::PositiveNumber);
  command.add_flag("--quick", quick, "small inputs and 3 rounds: to see that all works");
  command.add_option("--case", pattern, "only cases with this text in their name")->type_name("TEXT");
  const auto of_maps = "Of suites that make maps";
  command.add_option("--side", options.side, "of their source, texels; else 16384")
      ->type_name("N")
      ->check(CLI::Range(std::int64_t{256}, std::int64_t{65536}))
      ->group(of_maps);
  command.add_option("--sources", options.sources, "of their mosaic; else 400")
      ->type_name("N")
      ->check(CLI::Range(2, 100'000))
      ->group(of_maps);
  command.add_option("--keep", options.keep, "folder where sources are left to be used again")
      ->type_name("DIR")
      ->group(of_maps);
  command.add_flag("--large", options.large, "cases that take many minutes too")->group(of_maps);
  command.add_flag("--accept", options.accept, "of suite ci: what is counted becomes what is expected");
  command.add_flag("--list", list, "tell suites and their cases");
  command.add_flag("--json", json, "tell results as JSON");
  command.add_flag("--force", force, "write into DIR though it holds something");
  return app::run_command(command, argc, argv, [&]() -> Result<void> {
    if (list) {
      print_list();
      return {};
    }
    if (words.empty()) return fail(Error::Kind::NotFound, "no suite named; `nadir bench --list` tells them");
    if (!output.empty())
      if (const auto free = refuse_to_overwrite(output, force); !free) return free;
    options.quick = quick;
    options.pictures = output;
    if (quick && options.rounds == 0) options.rounds = 3;

    Measured measured;
    if (words[0] == "report") {
      if (words.size() < 2 || output.empty())
        return fail(Error::Kind::NotFound,
                    "report: expected files of results and a folder: nadir bench report CSV... -o DIR");
      auto rows = bench::read_csv({words.begin() + 1, words.end()});
      if (!rows) return fail(rows);
      measured.rows = std::move(*rows);
    } else {
      if (words.size() > 1)
        return fail(Error::Kind::NotFound, fmt::format("one suite at a time; what is '{}'?", words[1]));
      const auto suite = find_suite(words[0]);
      if (!suite) return fail(suite);
      auto result = measure(*suite, pattern, options);
      if (!result) return fail(result);
      measured = std::move(*result);
    }

    if (json)
      print_json(measured.rows);
    else
      fmt::print("{}", bench::to_table(measured.rows));
    if (!output.empty() && !measured.rows.empty()) {
      std::string line = "nadir bench";
      for (int i = 1; i < argc; ++i)
        line += std::string_view(argv[i]).find_first_of(" '\"$") == std::string_view::npos
                    ? fmt::format(" {}", argv[i])
                    : fmt::format(" '{}'", argv[i]);
      const auto warning = bench::write_report(measured.rows, {line, bench::machine()}, output);
      if (!warning) return fail(warning);
      if (!warning->empty()) app::print_fault(command, "warning: " + *warning);
      if (!json) fmt::print("{}\n", (fs::path(output) / "report.html").string());
    }
    if (!measured.faults.empty()) return fail(Error::Kind::Io, measured.faults);
    return {};
  });
}
