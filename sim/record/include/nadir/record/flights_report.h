#pragma once

#include <filesystem>
#include <span>

#include "nadir/sim/monte_carlo.h"

namespace nadir::record {

/// Writes what many flights of one run came to: flights.csv, a row each, and report.html, where they spread.
/// `seconds`: that they took.
Result<void> write_flights(const std::filesystem::path& folder, const sim::RunFile& run,
                           std::span<const sim::FlightOutcome> outcomes, double seconds);

}  // namespace nadir::record
