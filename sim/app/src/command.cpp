#include "command.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <new>

#include "nadir/base/text.h"

namespace nadir::app {
namespace {

/// The message for words that no option takes, with the option that was likely meant.
std::string unknown_words(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  const std::vector<std::string_view> known(names.begin(), names.end());
  std::string message;
  for (const std::string& word : app.remaining()) {
    const std::string near = word.starts_with("--") ? nearest_name(word, known) : "";
    message += fmt::format("{}unknown argument '{}'{}", message.empty() ? "" : "; ", word,
                           near.empty() ? "" : fmt::format(", did you mean '{}'?", near));
  }
  return message;
}

}  // namespace

void print_fault(const CLI::App& app, std::string_view message) {
  fmt::print(stderr, "{}: {}\n", app.get_name(), message);
}

int run_command(CLI::App& app, int argc, char** argv, const std::function<Result<void>()>& run) {
  app.get_formatter()->column_width(34);
  try {  // CLI11 reports by exception
    app.parse(argc, argv);
  } catch (const CLI::ExtrasError&) {
    print_fault(app, unknown_words(app) + fmt::format("; see `{} --help`", app.get_name()));
    return 2;
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);  // --help
    print_fault(app, fmt::format("{}; see `{} --help`", e.what(), app.get_name()));
    return 2;
  }
  try {
    const auto done = run();
    const bool told = std::fflush(stdout) == 0 && !std::ferror(stdout);
    if (!done)
      print_fault(app, done.error().message);
    else if (!told)
      print_fault(app, fmt::format("standard output: writing failed: {}", std::strerror(errno)));
    else
      return 0;
  } catch (const std::bad_alloc&) {
    print_fault(app, "out of memory; allow less with --cache, or render smaller frames");
  } catch (const std::exception& e) {
    print_fault(app, fmt::format("internal error: {}", e.what()));
  }
  return 1;
}

Result<void> report_damage(std::size_t frames, const std::set<std::string>& damage) {
  if (frames == 0) return {};
  const std::string others =
      damage.size() > 1 ? fmt::format("; {} more are listed with their frames", damage.size() - 1) : "";
  return fail(Error::Kind::Damaged, fmt::format("{} frame{} saw {} damaged tile{} and {} invalid there: {}{}", frames,
                                                frames == 1 ? "" : "s", damage.size(), damage.size() == 1 ? "" : "s",
                                                frames == 1 ? "is" : "are", *damage.begin(), others));
}

Result<std::vector<double>> parse_numbers(std::string_view what, std::string_view text, std::size_t least,
                                          std::size_t most, std::string_view example) {
  std::vector<double> values;
  for (std::string_view field : split(text, ',')) {
    const auto value = parse_number(field);
    if (!value)
      return fail(Error::Kind::Malformed,
                  fmt::format("{} '{}': '{}' is not a number; expected for instance {}", what, text, field, example));
    values.push_back(*value);
  }
  if (values.size() < least || values.size() > most)
    return fail(Error::Kind::Malformed, fmt::format("{} '{}': expected {} numbers, found {}; for instance {}", what,
                                                    text, most, values.size(), example));
  return values;
}

}  // namespace nadir::app
