#include "tell_time_budget.h"

#include <fmt/format.h>

namespace nadir::app {

void tell_time_budget(std::string_view whose, const render::FittedQuality& fitted, bool adaptive, bool quiet) {
  const std::string text =
      to_string(fitted) + (adaptive ? "; adaptive: later frames follow the times before them" : "");
  if (!fitted.fits())
    fmt::print(stderr, "{}: note: {}\n", whose, text);
  else if (!quiet)
    fmt::print("{}: {}\n", whose, text);
}

}  // namespace nadir::app
