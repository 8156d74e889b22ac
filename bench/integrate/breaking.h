#pragma once

#include <functional>
#include <string>
#include <vector>

namespace nadir::bench {

struct BreakingOutcome {
  bool as_expected = false;
  std::string happened;
};

/// A method taken to where it breaks, and what theory says of that.
struct Breaking {
  std::string name, expected;
  std::function<BreakingOutcome()> run;
};

std::vector<Breaking> breaking_cases();

}  // namespace nadir::bench
