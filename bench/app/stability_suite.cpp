// Views at the extremes: what is expected, what happened, how far it errs, how long it took.
#include "stability_cases.h"

#include <fmt/format.h>

#include <memory>

#include "nadir/bench/report.h"
#include "suites.h"

namespace nadir::bench {
namespace {

Method method_of(const StabilityCase& one, const std::string& scratch) {
  const auto outcome = std::make_shared<Outcome>();
  Method method{.name = one.name,
                .run = [=]() -> Result<void> {
                  *outcome = one.run(scratch);
                  return {};
                },
                .counters = [=]() -> std::map<std::string, std::string> {
                  std::map<std::string, std::string> told = {
                      {"expected", as_counter(one.expected)},
                      {"happened",
                       as_counter((outcome->as_expected ? "as expected: " : "NOT AS EXPECTED: ") + outcome->happened)}};
                  if (outcome->patch_error_px) told["patches_px"] = short_number(*outcome->patch_error_px);
                  return told;
                }};
  if (one.group == "views") method.error = [=]() -> Result<double> { return outcome->error_px.value_or(0); };
  if (one.grazing_rad) {  // points of one curve
    method.error = [=]() -> Result<double> { return outcome->on_ground_m.value_or(0); };
    method.name = "exact chain";
    method.setting = fmt::format("{:g} rad", *one.grazing_rad);
    method.point = Point{"loss on the ground towards grazing", *one.grazing_rad, "angle between ray and ground, rad"};
  }
  return method;
}

Result<Comparison> group_of(const std::string& name, const std::string& scratch) {
  Comparison comparison{.error_unit = name == "grazing" ? "m" : "px", .warm_up = false, .go_on = true, .rounds = 3};
  for (const StabilityCase& one : stability_cases())
    if (one.group == name) comparison.methods.push_back(method_of(one, scratch));
  return comparison;
}

}  // namespace

Suite stability_suite() {
  return {"stability", "views at the extremes: what is expected, what happened, how far it errs",
          [](const RunOptions& options) {
            std::vector<Case> cases;
            for (const std::string name : {"views", "grazing", "input", "maps"})
              cases.push_back({name, [=] { return group_of(name, options.scratch); }});
            return cases;
          }};
}

}  // namespace nadir::bench
