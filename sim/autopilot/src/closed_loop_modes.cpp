#include "nadir/sim/closed_loop_modes.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "nadir/geodesy/attitude.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;

/// One state of the loop: which loop it belongs to, and how far it is moved for a difference, small against where
/// anything bends and large against the rounding of positions from the Earth's centre, 1e-9 m.
struct LoopState {
  std::string_view loop;
  double step;
};
constexpr std::array<LoopState, 17> loop_states = {{{"path", 1e-2},
                                                    {"height", 1e-2},
                                                    {"airspeed", 1e-3},
                                                    {"yaw damper", 1e-3},
                                                    {"pitch", 1e-3},
                                                    {"course", 1e-5},
                                                    {"pitch", 1e-5},
                                                    {"roll", 1e-5},
                                                    {"roll", 1e-5},
                                                    {"pitch", 1e-5},
                                                    {"yaw damper", 1e-5},
                                                    {"pitch", 1e-5},
                                                    {"roll", 1e-5},
                                                    {"yaw damper", 1e-5},
                                                    {"height", 1e-5},
                                                    {"airspeed", 1e-5},
                                                    {"airspeed", 1e-3}}};
constexpr int state_count = static_cast<int>(loop_states.size());
using StateVector = Eigen::Matrix<double, state_count, 1>;
using StateMatrix = Eigen::Matrix<double, state_count, state_count>;

/// A flight north along a line through the origin, as numbers: east, height; velocity in body axes; yaw, pitch, roll;
/// rates; elevator, aileron, rudder; the autopilot's memory.
class Loop {
 public:
  Loop(const FixedWing& vehicle, const FeedForward& feed_forward, const FlightGains& gains, double density,
       double gravity)
      : vehicle_(vehicle),
        feed_forward_(feed_forward),
        gains_(gains),
        environment_(Environment::flat(origin_, gravity, density)),
        scene_(origin_),
        ecef_from_ned_(geodesy::ecef_from_ned(origin_)) {}

  StateVector trim() const {
    const Trim& level = feed_forward_.level;
    const double va = level.target.airspeed_mps;
    const Surfaces& s = level.controls.surfaces;
    StateVector z;
    z << 0, 0, va * std::cos(level.alpha_rad), 0, va * std::sin(level.alpha_rad), 0, level.pitch_rad, level.roll_rad,
        Vector3d::Zero(), s.elevator_rad, s.aileron_rad, s.rudder_rad, 0, 0, va;
    return z;
  }

  /// One period of the autopilot later.
  StateVector next(const StateVector& z) const {
    FixedWingState state;
    state.position = ecef_from_ned_ * geodesy::Point<geodesy::frame::Ned>{{0, z[0], -z[1]}};
    state.ecef_from_body.quaternion = ecef_from_ned_.rotation * geodesy::quaternion_from({z[5], z[6], z[7]});
    state.velocity.xyz = state.ecef_from_body.quaternion * Vector3d(z.segment<3>(2));
    state.body_rates_radps = z.segment<3>(8);
    state.surfaces = {z[11], z[12], z[13]};

    Autopilot autopilot(feed_forward_, gains_.autopilot);
    autopilot.remember({z[14], z[15], z[16]});
    const Navigation now = true_navigation(state, environment_, Vector3d::Zero(), scene_);
    const StraightPath line{{0, 0}, {1, 0}, 0, 0};
    const Controls controls = autopilot.step(follow(line, now, gains_.path), now, control_period_s);
    constexpr int steps = 4;
    for (int i = 0; i < steps; ++i) {
      const auto moved =
          advance(vehicle_, environment_, state, controls, Vector3d(Vector3d::Zero()), 0, control_period_s / steps);
      if (!moved) return StateVector::Constant(std::numeric_limits<double>::quiet_NaN());
      state = *moved;
    }

    const Navigation then = true_navigation(state, environment_, Vector3d::Zero(), scene_);
    const AutopilotMemory& memory = autopilot.memory();
    StateVector out;
    out << then.east_m, then.height_m, state.ecef_from_body.quaternion.conjugate() * state.velocity.xyz,
        std::remainder(then.attitude.yaw_rad, 2 * std::numbers::pi), then.attitude.pitch_rad, then.attitude.roll_rad,
        state.body_rates_radps, state.surfaces.elevator_rad, state.surfaces.aileron_rad, state.surfaces.rudder_rad,
        memory.climb_rad, memory.throttle, memory.airspeed_mps;
    return out;
  }

 private:
  const geodesy::Geodetic origin_{0.7, 0, 0};
  const FixedWing& vehicle_;
  const FeedForward& feed_forward_;
  const FlightGains& gains_;
  Environment environment_;
  geodesy::LocalFrame scene_;
  geodesy::Pose<geodesy::frame::Ecef, geodesy::frame::Ned> ecef_from_ned_;
};

std::string_view gains_of(std::string_view loop) {
  if (loop == "roll") return "roll_kp, roll_kd";
  if (loop == "pitch") return "pitch_kp, pitch_kd";
  if (loop == "yaw damper") return "yaw_damper";
  if (loop == "course") return "course_kp";
  if (loop == "height") return "height_kp, climb_kp, climb_ki";
  if (loop == "path") return "line_per_m";
  return "airspeed_kp, airspeed_ki, or those of energy";
}

}  // namespace

std::vector<LoopMode> closed_loop_modes(const FixedWing& vehicle, const FeedForward& feed_forward,
                                        const FlightGains& gains, double density_kgpm3, double gravity_mps2) {
  const Loop loop(vehicle, feed_forward, gains, density_kgpm3, gravity_mps2);
  const StateVector trim = loop.trim();
  StateMatrix all;
  for (int i = 0; i < state_count; ++i) {
    const StateVector d = loop_states[static_cast<std::size_t>(i)].step * StateVector::Unit(i);
    all.col(i) = (loop.next(trim + d) - loop.next(trim - d)) / (2 * d[i]);
  }
  if (!all.allFinite()) return {{"path", {std::numeric_limits<double>::infinity(), 0}}};

  // The last state is total energy's alone
  const int count = gains.autopilot.control == Control::TotalEnergy ? state_count : state_count - 1;
  const Eigen::EigenSolver<Eigen::MatrixXd> solver(all.topLeftCorner(count, count));
  const Eigen::MatrixXcd right = solver.eigenvectors(), left = right.inverse();
  std::vector<LoopMode> modes;
  for (int k = 0; k < count; ++k) {
    const std::complex<double> z = solver.eigenvalues()[k];
    // What is gone within a period, and the lower of two conjugates, tell nothing more
    if (std::abs(z) < 1e-6 || z.imag() < 0) continue;
    std::array<std::pair<double, std::string_view>, 7> parts{};
    for (int i = 0; i < count; ++i) {
      const std::string_view name = loop_states[static_cast<std::size_t>(i)].loop;
      const auto part =
          std::find_if(parts.begin(), parts.end(), [&](const auto& p) { return p.second.empty() || p.second == name; });
      part->first += std::abs(left(k, i) * right(i, k));
      part->second = name;
    }
    modes.push_back({std::max_element(parts.begin(), parts.end())->second, std::log(z) / control_period_s});
  }
  std::stable_sort(modes.begin(), modes.end(),
                   [](const LoopMode& a, const LoopMode& b) { return a.s_per_s.real() > b.s_per_s.real(); });
  return modes;
}

Result<void> check_stable(const std::vector<LoopMode>& modes) {
  std::string faults;
  for (const LoopMode& mode : modes) {
    if (!mode.grows()) break;
    faults += fmt::format(
        "{}the {} loop is unstable: it grows by a factor of e in {:.2g} s, with a damping of {:.2f} at "
        "{:.2g} rad/s; its gains: {}",
        faults.empty() ? "" : "\n", mode.loop, 1 / mode.s_per_s.real(), mode.damping(), std::abs(mode.s_per_s),
        gains_of(mode.loop));
  }
  if (faults.empty()) return {};
  return fail(Error::Kind::Unsupported, faults);
}

}  // namespace nadir::sim
