#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "nadir/sim/run.h"

namespace nadir::record {

/// Beside frames.jsonl, where something happened in a flight: a line each, in the order of time.
inline constexpr const char* events_file = "events.jsonl";

/// A line of that file, without the line feed. `events.schema.json` describes it.
std::string event_record(const sim::RunEvent& event);

/// The file in a dataset's folder; none where nothing happened.
Result<void> write_events(const std::filesystem::path& folder, std::span<const sim::RunEvent> events);

}  // namespace nadir::record
