#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/sim/air_motion.h"
#include "nadir/sim/battery.h"
#include "nadir/sim/contact.h"
#include "nadir/sim/environment.h"
#include "nadir/sim/rigid_body.h"
#include "nadir/sim/rotor.h"

namespace nadir::sim {

/// A multirotor whose rotors are not told apart: thrust against the body's z axis and moments follow commands behind
/// lags. Controls are four: share of the greatest thrust, [0, 1], and of the greatest moments about x, y, z, [-1, 1].
struct LumpedRotors {
  double max_thrust_n = 0;
  Eigen::Vector3d max_moment_nm = Eigen::Vector3d::Zero();
  /// Lags of thrust, and of moments about x, y, z, where they grow and where they fall.
  std::array<double, 4> rise_time_constant_s{}, fall_time_constant_s{};
  double rotor_radius_m = 0;  // for ground effect
};

/// What slows a multirotor down beside its rotors' torque.
struct MultirotorDrag {
  double coefficient = 0, area_m2 = 0;  // of the body, along the flow
  double linear_nspm = 0;               // force per speed against the air
  double angular_nms = 0;               // moment per rate against the air
  double induced_spm = 0;               // force in a rotor's plane per speed in that plane and per thrust
};

/// More thrust near the ground.
struct GroundEffect {
  enum class Law {
    None,
    /// Of each rotor at its own height z: 1 / (1 - (R / 4z)^2 / (1 + (V/v)^2)), V across its axis and v its own
    /// downwash. Below z = R/2, where the law ends, as there: a third more. Source: Cheeseman and Bennett, The Effect
    /// of the Ground on a Helicopter Rotor in Forward Flight, ARC R&M 3021, 1955.
    CheesemanBennett,
    /// A force of the whole vehicle that is a polynomial of its height, as rosflight_sim has it, where it is not
    /// negative: for comparison with it. It is none on the ground and returns at 1.0 to 1.2 m.
    Polynomial,
  };
  Law law = Law::None;
  std::array<double, 5> force_n{};  // per m^4, m^3, m^2, m, constant
};

/// A vehicle that rotors carry. `faults_of` says what is wrong with one.
struct Multirotor {
  MassProperties mass;
  std::vector<Rotor> rotors;           // none where they are lumped
  std::optional<LumpedRotors> lumped;  // instead
  MultirotorDrag drag;
  GroundEffect ground_effect;
  std::optional<Battery> battery;   // else motors have the voltage that they say
  std::optional<ContactGear> gear;  // else legs that follow from its rotors: `gear_of`
};

/// Each fault on its own: no rotors, rotors that are neither lumped nor listed, axes not of unit length, lags below 0,
/// some rotors with inertia and some without, and so on; by the section of a parameter file that it is in.
std::vector<ParameterFault> faults_of(const Multirotor& vehicle);

/// How many controls it takes.
int actuator_count(const Multirotor& vehicle);

/// Throttle of each rotor, [0, 1]; of lumped rotors as there. A vehicle takes what lies in its limits.
struct MultirotorControls {
  RotorValues actuators;
};

/// All that the future of a flight depends on, besides controls and air. What a vehicle does not have is empty.
struct MultirotorState : BodyState {
  RotorValues followed;            // behind lags: throttles, or thrusts, or lumped thrust and moments (N, N m)
  RotorValues followed_torque_nm;  // of pulse drives
  RotorValues omega_radps;         // of rotors with inertia
  RotorValues current_a;           // of motors with inductance
  double charge_ah = 0;
};

/// Everything about the rotors in one moment.
struct MultirotorOutput {
  Loads loads;                                              // rotors, drag, ground effect
  RotorValues thrust_n, torque_nm, omega_radps, current_a;  // one for each rotor; none where they are lumped
  RotorValues spin_radps2, current_change_aps;              // where integrated
  double supply_v = 0, supply_current_a = 0;                // of the battery
};

/// Whether the current of an inductance is integrated, or taken as settled (`settled_spin_change`).
enum class CurrentModel { Settled, Integrated };

/// Forces on a vehicle in flight: force over mass is the specific force of an accelerometer in the centre of mass.
/// `height_m`: of the centre of mass above ground, for ground effect.
MultirotorOutput output(const Multirotor& vehicle, const BodyInAir& in_air, const MultirotorState& state,
                        const MultirotorControls& controls, double height_m, CurrentModel currents);
MultirotorOutput output(const Multirotor& vehicle, const Environment& environment, const MultirotorState& state,
                        const MultirotorControls& controls, const AirMotion& air, double height_m = no_ground_m);

/// What stands behind lags that a command has driven for `duration_s`, exactly, however long. Changes no more than
/// `followed` and `followed_torque_nm` of the state.
void follow_for(const Multirotor& vehicle, const MultirotorControls& controls, double duration_s,
                MultirotorState& state);

/// The state `dt_s` after `t_s`, far from any ground, by Runge-Kutta steps with controls held: as many as motors need
/// that are faster than `dt_s`; currents are integrated where a step is shorter than their lag, else settled. Fails
/// where the motion diverges.
Result<MultirotorState> advance(const Multirotor& vehicle, const Environment& environment, const MultirotorState& state,
                                const MultirotorControls& controls, const AirOverTime& air, double t_s, double dt_s);

}  // namespace nadir::sim
