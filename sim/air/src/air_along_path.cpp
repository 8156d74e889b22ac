#include "nadir/sim/air_along_path.h"
#include "nadir/base/time.h"

#include <algorithm>
#include <cmath>

namespace nadir::sim {
namespace {
using Eigen::Vector3d;
using geodesy::Point, geodesy::frame::Ecef;

constexpr double period_s = seconds_from_ns(AirAlongPath::period_ns);
constexpr double least_passage_mps = 1;

double time_of_sample_s(std::int64_t sample) { return seconds_from_ns(sample * AirAlongPath::period_ns); }

/// Forward along the level unit vector `heading_ned`, right, down.
Vector3d ned_from_level(const Vector3d& heading_ned, const Vector3d& v) {
  const double n = heading_ned.x(), e = heading_ned.y();
  return {n * v.x() - e * v.y(), e * v.x() + n * v.y(), v.z()};
}

}  // namespace

Result<AirAlongPath> AirAlongPath::start(AirParts parts, const Point<Ecef>& place, const Vector3d& heading_ned,
                                         double airspeed_mps) {
  AirAlongPath air(std::move(parts));
  air.heading_ned_ = heading_ned;
  const auto wind = air.of_sources(0, place);
  if (!wind) return fail(wind);
  air.wind_ned_mps_ = *wind;
  AirMotion first(*wind);
  if (air.parts_.turbulence) first += air.turned(air.parts_.turbulence->start(air.passage(airspeed_mps, place)));
  air.air_ = AirOverTime(first);
  return air;
}

Result<Vector3d> AirAlongPath::of_sources(double time_s, const Point<Ecef>& place) {
  const AirPlace here{time_s, place, parts_.height_above_ground_m(place)};
  Vector3d sum = Vector3d::Zero();
  for (const auto& source : parts_.sources) {
    const auto wind = source->towards_ned_mps(here);
    if (!wind) return fail(wind);
    sum += *wind;
  }
  return sum;
}

AirMotion AirAlongPath::turned(const TurbulenceSample& sample) const {
  return {ned_from_level(heading_ned_, sample.velocity_mps), ned_from_level(heading_ned_, sample.rates_radps)};
}

Passage AirAlongPath::passage(double speed_mps, const Point<Ecef>& place) const {
  return {std::max(speed_mps, least_passage_mps), parts_.height_above_ground_m(place)};
}

Result<void> AirAlongPath::advance(const Environment& environment, const PathPoint& now) {
  const double now_s = time_of_sample_s(samples_), next_s = time_of_sample_s(samples_ + 1);
  const AirMotion from = air_.end();
  ++samples_;
  const Point<Ecef> next{now.position.xyz + period_s * now.velocity.xyz};
  const auto wind = of_sources(next_s, next);
  if (!wind) return fail(wind);
  AirMotion to(*wind);

  if (!parts_.gusts.empty() || parts_.turbulence) {
    const Vector3d through_air =
        environment.at(now.position).ecef_from_ned.transpose() * now.velocity.xyz - wind_ned_mps_;
    const Vector3d level(through_air.x(), through_air.y(), 0);
    if (level.norm() > 0.1) heading_ned_ = level.normalized();
    const double speed_mps = std::max(through_air.norm(), least_passage_mps);

    // Gusts that begin within this step, and how far the vehicle is into those it has met
    for (std::size_t i = 0; i < parts_.gusts.size(); ++i) {
      const Gust& gust = parts_.gusts[i];
      if (gust.start_s >= now_s && gust.start_s < next_s)
        met_.push_back(
            {i, flown_m_ + speed_mps * (gust.start_s - now_s), ned_from_level(heading_ned_, gust.direction())});
    }
    flown_m_ += speed_mps * period_s;
    for (const Met& met : met_)
      to.velocity_ned_mps += parts_.gusts[met.gust].speed_at_mps(flown_m_ - met.begins_m) * met.towards_ned_mps;
    if (parts_.turbulence) to += turned(parts_.turbulence->advance(passage(speed_mps, now.position), period_s));
  }
  wind_ned_mps_ = *wind;
  air_ = AirOverTime(now_s, from, next_s, to);
  return {};
}

}  // namespace nadir::sim
