#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "nadir/base/result.h"

namespace nadir::app {

/// What all commands share: `prefix: message` on standard error for faults, exit code 0 only when all was done, 1 where
/// something failed, 2 where the command line was wrong.
/// `run` is called once the arguments are parsed.
int run_command(CLI::App& app, int argc, char** argv, const std::function<Result<void>()>& run);

/// "nadir render: message" on standard error.
void print_fault(const CLI::App& app, std::string_view message);

/// The error at the end of a command of whose frames some saw damaged tiles (`damage`, each once); none where none did.
Result<void> report_damage(std::size_t frames, const std::set<std::string>& damage);

/// `count` numbers between commas; `what` and `example` are for the message where they are not that.
Result<std::vector<double>> parse_numbers(std::string_view what, std::string_view text, std::size_t least,
                                          std::size_t most, std::string_view example);

}  // namespace nadir::app
