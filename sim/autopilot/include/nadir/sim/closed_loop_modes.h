#pragma once

#include <complex>
#include <string>
#include <string_view>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/sim/gain_design.h"

namespace nadir::sim {

/// One mode of a vehicle's small motions under its autopilot: it goes with exp(s t).
struct LoopMode {
  std::string_view loop;         // that takes the greatest part in it, by participation factors
  std::complex<double> s_per_s;  // imaginary part from 0
  double damping() const { return s_per_s == 0.0 ? 1 : -s_per_s.real() / std::abs(s_per_s); }
  bool grows() const { return s_per_s.real() > 1e-3; }  // by a factor e in less than a quarter of an hour
};

/// Of level flight along a line over a flat Earth, least stable first: eigenvalues of what one period of the autopilot,
/// servos and sampling included, makes of each state, by central differences. Path, height, course, attitude, rates,
/// airspeed, surfaces and the autopilot's memory are states. Error: about 1e-5 1/s. Source of participation factors:
/// Perez-Arriaga, Verghese and Schweppe, Selective modal analysis with applications to electric power systems, 1982.
std::vector<LoopMode> closed_loop_modes(const FixedWing& vehicle, const FeedForward& feed_forward,
                                        const FlightGains& gains, double density_kgpm3, double gravity_mps2);

/// Fails where a mode grows, and names its loop, its damping and its gains.
Result<void> check_stable(const std::vector<LoopMode>& modes);

}  // namespace nadir::sim
