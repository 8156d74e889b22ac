#pragma once

#include <string_view>

#include "nadir/render/time_budget.h"

namespace nadir::app {

/// Says what a time budget was resolved to: on standard output unless `quiet`, and on standard error where it is not
/// kept. `whose`: the command, and what of it.
void tell_time_budget(std::string_view whose, const render::FittedQuality& fitted, bool adaptive, bool quiet);

}  // namespace nadir::app
