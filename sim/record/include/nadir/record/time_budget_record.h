#pragma once

#include <string>
#include <vector>

#include "nadir/render/time_budget.h"

namespace nadir::record {

/// Beside frames.jsonl, where sensors had time budgets: a line each.
inline constexpr const char* time_budgets_file = "time_budgets.jsonl";

/// A line of that file, without the line feed: what a time budget was resolved to, before the first frame of the
/// sensors whose frames share it, and from which measurements. `time_budgets.schema.json` describes it.
std::string time_budget_record(const std::string& vehicle, const std::vector<std::string>& sensors, bool adaptive,
                               const render::FittedQuality& fitted);

}  // namespace nadir::record
