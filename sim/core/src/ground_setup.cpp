#include "nadir/sim/ground_setup.h"

#include <fmt/format.h>

#include <algorithm>

#include "nadir/geodesy/geodetic.h"
#include "read_yaml.h"

namespace nadir::sim {
namespace {

using geodesy::to_radians;

TakeoffSetup read_takeoff(const YamlMap& yaml) {
  TakeoffSetup setup;
  setup.launch_mps = positive(yaml, "launch_mps");
  take_within(yaml, "launch_pitch_deg", -10, 60, setup.launch_pitch_deg);
  take_positive(yaml, "rotate_mps", setup.rotate_mps);
  take_within(yaml, "rotate_pitch_deg", 0, 20, setup.rotate_pitch_deg);
  take_within(yaml, "climb_mps", 0.5, 20, setup.climb_mps);
  take_within(yaml, "clear_m", 2, 1000, setup.clear_m);
  if (!setup.launch_mps && yaml.has("launch_pitch_deg"))
    yaml.fault("launch_pitch_deg", "expected launch_mps beside it: the airspeed of the launch");
  return setup;
}

LandingSetup read_landing(const YamlMap& yaml) {
  LandingSetup setup;
  for (const char* key : {"north_m", "east_m", "yaw_deg"}) yaml.require(key);
  take(yaml.number("north_m"), setup.north_m);
  take(yaml.number("east_m"), setup.east_m);
  take(yaml.number("yaw_deg"), setup.yaw_deg);
  take_within(yaml, "glide_deg", 1, 15, setup.glide_deg);
  take_within(yaml, "approach_height_m", 10, 1000, setup.approach_height_m);
  take_within(yaml, "straight_m", 10, 10'000, setup.straight_m);
  take_positive(yaml, "airspeed_mps", setup.airspeed_mps);
  return setup;
}

LimitsSetup read_limits(const YamlMap& yaml) {
  return {positive(yaml, "sink_mps"), positive(yaml, "bank_deg"), positive(yaml, "load_factor")};
}

/// Of the centre of mass over the ground, springs unloaded; 0 without wheels or skids.
double standing_m(const ContactGear& gear) {
  double lowest_m = 0;
  for (const ContactPoint& point : gear.points())
    if (point.kind != ContactPoint::Kind::Part) lowest_m = std::max(lowest_m, point.body_m.z());
  return lowest_m;
}

}  // namespace

GroundSetup read_ground(const YamlMap& vehicle) {
  GroundSetup setup;
  if (const auto takeoff = vehicle.map("takeoff")) setup.takeoff = read_takeoff(*takeoff);
  if (const auto land = vehicle.map("land")) setup.land = read_landing(*land);
  if (const auto limits = vehicle.map("limits")) setup.limits = read_limits(*limits);
  return setup;
}

std::string ground_text(const GroundSetup& setup) {
  std::string text;
  if (const auto& t = setup.takeoff)
    text += fmt::format(
        "    takeoff: {{{}rotate_mps: {}, rotate_pitch_deg: {}, climb_mps: {}, clear_m: {}}}\n",
        t->launch_mps ? fmt::format("launch_mps: {}, launch_pitch_deg: {}, ", *t->launch_mps, t->launch_pitch_deg) : "",
        t->rotate_mps, t->rotate_pitch_deg, t->climb_mps, t->clear_m);
  if (const auto& l = setup.land)
    text += fmt::format(
        "    land: {{north_m: {}, east_m: {}, yaw_deg: {}, glide_deg: {}, approach_height_m: {}, straight_m: {}, "
        "airspeed_mps: {}}}\n",
        l->north_m, l->east_m, l->yaw_deg, l->glide_deg, l->approach_height_m, l->straight_m, l->airspeed_mps);
  std::string limits;
  const auto add = [&](const char* key, const std::optional<double>& value) {
    if (value) limits += fmt::format("{}{}: {}", limits.empty() ? "" : ", ", key, *value);
  };
  add("sink_mps", setup.limits.sink_mps);
  add("bank_deg", setup.limits.bank_deg);
  add("load_factor", setup.limits.load_factor);
  return limits.empty() ? text : text + "    limits: {" + limits + "}\n";
}

std::shared_ptr<const Ground> ground_of(const render::Surface& surface) {
  if (surface.plane()) return std::make_shared<PlaneGround>(surface.frame(), surface.up_m());
  return std::make_shared<EllipsoidGround>(surface.height_m());
}

Result<FixedWingGroundSetup> ground_flight(const GroundSetup& setup, const FixedWing& vehicle,
                                           const render::Surface& surface, const Waypoint& start, double yaw_rad,
                                           bool on_ground) {
  FixedWingGroundSetup out;
  out.ground = ground_of(surface);
  const double up_m = standing_m(vehicle.gear.value_or(ContactGear()));
  const bool launched = setup.takeoff && setup.takeoff->launch_mps;
  if (up_m == 0 && (setup.land || on_ground || (setup.takeoff && !launched)))
    return fail(Error::Kind::Unsupported,
                "it has no wheels to stand, roll or land on: expected `gear:` with wheels or skids in its parameter "
                "file, or a start in the air or a launch, and no land");
  if (on_ground && launched)
    return fail(Error::Kind::Malformed, "takeoff: launch_mps: expected a start above the ground to launch it from");
  if (setup.takeoff && !on_ground && !launched)
    return fail(Error::Kind::Malformed,
                "takeoff: expected a start on the ground (height: 0 agl), or launch_mps: it is in the air already");
  out.standing = on_ground;
  if (on_ground || launched) {
    const TakeoffSetup t = setup.takeoff.value_or(TakeoffSetup{});
    out.launch_mps = t.launch_mps.value_or(0);
    out.launch_pitch_rad = to_radians(t.launch_pitch_deg);
    out.takeoff = TakeoffPlan{.runway = {{start.north_m, start.east_m}, yaw_rad, start.height_m},
                              .launched = launched,
                              .rotate_mps = t.rotate_mps,
                              .rotate_pitch_rad = to_radians(t.rotate_pitch_deg),
                              .climb_mps = t.climb_mps,
                              .clear_m = t.clear_m};
  }
  if (const auto& l = setup.land) {
    // The ground's height there, in the scene's tangent plane
    const Eigen::Vector3d there(l->east_m, l->north_m, surface.up_m());
    const auto place = surface.frame().ecef_from_enu() * geodesy::Point<geodesy::frame::Enu>{there};
    out.landing = LandingPlan{.runway = {{l->north_m, l->east_m},
                                         to_radians(l->yaw_deg),
                                         surface.up_m() - out.ground->under(place).height_m + up_m},
                              .glide_rad = to_radians(l->glide_deg),
                              .approach_height_m = l->approach_height_m,
                              .airspeed_mps = l->airspeed_mps};
  }
  const auto limit = [](const std::optional<double>& value, double scale) {
    return value ? *value * scale : std::numeric_limits<double>::infinity();
  };
  out.limits = {limit(setup.limits.sink_mps, 1), limit(setup.limits.bank_deg, to_radians(1)),
                limit(setup.limits.load_factor, 1)};
  return out;
}

}  // namespace nadir::sim
