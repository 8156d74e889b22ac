#include "nadir/record/time_budget_record.h"

#include <nlohmann/json.hpp>

namespace nadir::record {
namespace {

using Json = nlohmann::ordered_json;

Json or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

Json rung_json(std::size_t rung) {
  const render::Rung& way = render::quality_ladder()[rung];
  return {{"quality", render::to_string(way.quality)}, {"oversampling", or_null(way.oversampling)}};
}

}  // namespace

std::string time_budget_record(const std::string& vehicle, const std::vector<std::string>& sensors, bool adaptive,
                               const render::FittedQuality& fitted) {
  Json measured = Json::array();
  for (std::size_t rung = 0; rung < fitted.measured_ms.size(); ++rung) {
    measured.push_back(rung_json(rung));
    measured.back()["slowest_ms"] = fitted.measured_ms[rung];
  }
  const Json json = {{"format_version", 1},
                     {"vehicle", vehicle},
                     {"sensors", sensors},
                     {"time_budget_ms", fitted.budget_ms},
                     {"adaptive", adaptive},
                     {"settings", rung_json(fitted.rung)},
                     {"expected_ms", or_null(fitted.expected_ms())},
                     {"fits", fitted.fits()},
                     {"frames_tried", fitted.probes},
                     {"measured", measured}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace nadir::record
