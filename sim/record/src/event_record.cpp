#include "nadir/record/event_record.h"

#include <nlohmann/json.hpp>

#include "nadir/base/files.h"

namespace nadir::record {

std::string event_record(const sim::RunEvent& event) {
  using Json = nlohmann::ordered_json;
  return Json{{"format_version", 1},       {"time_ns", event.event.time_ns}, {"vehicle", event.vehicle},
              {"event", event.event.name}, {"text", event.event.text},       {"ends_flight", event.event.ends_flight}}
      .dump(-1, ' ', false, Json::error_handler_t::replace);
}

Result<void> write_events(const std::filesystem::path& folder, std::span<const sim::RunEvent> events) {
  if (events.empty()) return {};
  std::string lines;
  for (const sim::RunEvent& event : events) lines += event_record(event) + "\n";
  return write_file(folder / events_file, lines);
}

}  // namespace nadir::record
