#pragma once

#include <cmath>
#include <functional>
#include <stdexcept>
#include <vector>

#include "nadir/sim/closed_loop_modes.h"
#include "nadir/sim/mission.h"
#include "vehicle/aerosonde.h"

namespace nadir::sim {

inline constexpr double step_s = 1.0 / 400;  // of the vehicle
inline constexpr int steps_per_command = 4;  // the autopilot at 100 Hz
inline const geodesy::Geodetic scene_origin = geodesy::Geodetic::degrees(38.1, -0.76, 0);

/// A vehicle with its autopilot, trimmed over the scene's origin and heading north. Vehicle at 400 Hz,
/// autopilot at 100 Hz.
class ClosedLoop {
 public:
  ClosedLoop(const Environment& environment, double height_m, const Eigen::Vector3d& wind_ned_mps,
             double airspeed_mps = 25, const std::function<void(FlightGains&)>& change = {},
             const FixedWing& vehicle = aerosonde())
      : vehicle_(vehicle),
        environment_(environment),
        wind_(wind_ned_mps),
        here_(environment.at(geodesy::ecef_from_geodetic(place(height_m)))),
        feed_forward_(feed_forward(vehicle, airspeed_mps, here_.density_kgpm3, gravity_mps2()).value()),
        gains(gains_with(change)),
        autopilot(feed_forward_, gains.autopilot),
        state(trimmed_state(feed_forward_.level, environment, place(height_m), 0, wind_ned_mps)) {}

  Navigation now() const { return true_navigation(state, environment_, wind_, scene_); }
  const Controls& trim_controls() const { return feed_forward_.level.controls; }

  /// Flies on. `guide(now)` gives the guidance 100 times a second; `look(now)` is shown every command's moment.
  template <class Guide, class Look>
  void fly(double seconds, const Guide& guide, const Look& look) {
    const long end = step_ + std::lround(seconds / step_s);
    for (; step_ < end; ++step_) {
      if (step_ % steps_per_command == 0) {
        const Navigation here = now();
        look(here);
        controls = autopilot.step(guide(here), here, steps_per_command * step_s);
      }
      const auto next =
          advance(vehicle_, environment_, state, controls, wind_, static_cast<double>(step_) * step_s, step_s);
      if (!next) throw std::runtime_error(next.error().message);
      state = *next;
    }
  }

 private:
  static geodesy::Geodetic place(double height_m) { return {scene_origin.lat_rad, scene_origin.lon_rad, height_m}; }
  double gravity_mps2() const { return here_.gravity_ecef_mps2.norm(); }
  FlightGains gains_with(const std::function<void(FlightGains&)>& change) const {
    FlightGains out = designed_gains(vehicle_, feed_forward_.level, here_.density_kgpm3, gravity_mps2());
    if (change) change(out);
    return out;
  }

  FixedWing vehicle_;
  Environment environment_;
  Eigen::Vector3d wind_;
  Surroundings here_;
  geodesy::LocalFrame scene_{scene_origin};
  FeedForward feed_forward_;
  long step_ = 0;

 public:
  FlightGains gains;
  Autopilot autopilot;
  std::vector<LoopMode> modes() const {
    return closed_loop_modes(vehicle_, feed_forward_, gains, here_.density_kgpm3, gravity_mps2());
  }
  FixedWingState state;
  Controls controls;
};

/// A square of 1 km, two of its corners 20 m higher than the others, flown clockwise for ever.
inline Mission square(double height_m, double turn_radius_m) {
  const Waypoint start{0, 0, height_m};
  const MissionItem corners[] = {Waypoint{1000, 0, height_m}, Waypoint{1000, 1000, height_m + 20},
                                 Waypoint{0, 1000, height_m + 20}, Waypoint{0, 0, height_m}};
  return Mission::create(start, corners, turn_radius_m, AfterMission::Repeat).value();
}

}  // namespace nadir::sim
