#include "flown_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nadir/base/time.h"

namespace nadir::sim {

Scheme scheme_of_part(Scheme scheme, std::int64_t part_ns, std::int64_t whole_ns) {
  const double share = static_cast<double>(part_ns) / static_cast<double>(whole_ns);
  scheme.steps = std::max(1, static_cast<int>(std::ceil(scheme.steps * share)));
  return scheme;
}

FlightData data_of(const BodyState& body, const BodyInAir& in_air, const AirMotion& air) {
  FlightData data;
  data.velocity_ned_mps = in_air.here.ecef_from_ned.transpose() * body.velocity.xyz;
  data.rates_radps = body.body_rates_radps;
  data.wind_ned_mps = air.velocity_ned_mps;
  data.airspeed_mps = in_air.flow.airspeed_mps;
  data.alpha_rad = in_air.flow.alpha_rad;
  data.beta_rad = in_air.flow.beta_rad;
  return data;
}

std::optional<GearCrash> crash_of(const ContactReport& report, const ContactGear& gear, std::int64_t from_ns,
                                  std::int64_t to_ns) {
  const auto &part = report.part, &broken = report.broken;
  if (!part && !broken) return std::nullopt;
  const bool breaks = broken && (!part || broken->time_s < part->time_s);
  const ContactReport::Crash& crash = breaks ? *broken : *part;
  return GearCrash{std::clamp(ns_from_seconds(crash.time_s), from_ns, to_ns),
                   fmt::format("the {} {}", gear.points()[static_cast<std::size_t>(crash.point)].name,
                               breaks ? "breaks" : "meets the ground")};
}

}  // namespace nadir::sim
