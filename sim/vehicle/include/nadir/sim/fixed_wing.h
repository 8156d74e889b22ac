#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>

#include "nadir/base/result.h"
#include "nadir/sim/air_motion.h"
#include "nadir/sim/contact.h"
#include "nadir/sim/environment.h"
#include "nadir/sim/rigid_body.h"
#include "nadir/sim/slipstream.h"

namespace nadir::sim {

/// How one coefficient of force or moment depends on the flow: its value at rest and its slopes, per radian, and per
/// b p / (2 Va), c q / (2 Va), b r / (2 Va) for the body rates.
struct Coefficient {
  double zero = 0, alpha = 0, beta = 0;
  double p = 0, q = 0, r = 0;
  double elevator = 0, aileron = 0, rudder = 0;
};

/// What a stall changes.
enum class StallModel {
  Lift,      // lift alone, as the published models have it; everything else stays linear, and jumps at alpha = 180 deg
  Airframe,  // drag, pitching moment and roll damping too: `aerodynamics`
};

/// A fixed-wing aircraft with linear aerodynamics, a stall and one propeller along the body's x axis.
/// Positive elevator pushes the nose down, positive aileron rolls right, positive rudder turns the nose left, for signs
/// of the derivatives as the shipped models have them.
struct FixedWing {
  MassProperties mass;
  double wing_area_m2 = 0, span_m = 0, chord_m = 0;
  double oswald = 0.9;         // efficiency of the wing in induced drag
  double stall_alpha_rad = 0;  // where the lift is half linear, half a flat plate's
  double stall_sharpness = 0;  // of that blend, per radian, at most 150
  StallModel stall_model = StallModel::Airframe;

  Coefficient lift;  // up to the stall
  Coefficient drag;  // `zero` is parasitic; what lift induces comes on top
  Coefficient side;
  Coefficient roll, pitch, yaw;

  FixedWingPropulsion propulsion;
  double servo_time_constant_s = 0;  // of each surface's first-order lag, >= 0
  double max_deflection_rad = 0;     // of each surface, either way
  bool feels_ground = true;          // has less induced drag near it
  std::optional<ContactGear> gear;   // none: the airframe itself, which may not touch

  double cruise_mps = 0;  // airspeed that it is flown at unless told
};

/// Where surfaces are. Radians.
struct Surfaces {
  double elevator_rad = 0, aileron_rad = 0, rudder_rad = 0;
};

/// What an autopilot asks for; a vehicle takes what lies in its limits. The motor follows at once, surfaces with a lag.
struct Controls {
  Surfaces surfaces;
  double throttle = 0;  // [0, 1]
};

/// All that the future of a flight depends on, besides controls and wind.
struct FixedWingState : BodyState {
  Surfaces surfaces;
};

/// Where surfaces stand that a command has driven for `duration_s`, exactly, however long: limits, then the servos'
/// lag.
Surfaces surfaces_after(const FixedWing& vehicle, const Surfaces& from, const Surfaces& command, double duration_s);

/// Share of the flat plate in the wing's lift: 0 while the flow is attached, 1/2 at the stall on either side, 1 beyond.
/// Source: Beard and McLain, Small Unmanned Aircraft, 2012, equation 4.10, written as a product of two logistic
/// functions, which does not overflow.
double stall_blend(const FixedWing& vehicle, double alpha_rad);

/// Of the wing, over the stall, with surfaces in the middle and no rates.
double lift_coefficient(const FixedWing& vehicle, double alpha_rad);

/// The greatest of them, and where it is.
struct GreatestLift {
  double coefficient = 0, alpha_rad = 0;
};
GreatestLift greatest_lift(const FixedWing& vehicle);

/// Share of the induced drag that is left at a height above ground: the image of the wing's vortices in the ground
/// takes away downwash. 1 at any height above `ground_effect_spans`, where 0.1 % would be missing.
/// Source: McCormick, Aerodynamics, Aeronautics and Flight Mechanics, 1995, chapter 7: s^2 / (1 + s^2) with s 16 times
/// the height over the span.
double ground_effect(const FixedWing& vehicle, double height_m);
inline constexpr double ground_effect_spans = 2;

/// What air and surfaces do, without the propeller.
/// Terms with body rates are written with Va in the numerator, so that nothing is divided by airspeed and the loads
/// fade to zero with it. `rates_radps`: against the air, as it turns itself.
///
/// A stall that changes the airframe fades what is linear in alpha into plates, finite and continuous at every angle:
/// - The wing lifts 2 sin^2 cos and drags 2 sin^3 of alpha (Beard and McLain, equation 4.10), and its centre of
/// pressure
///   moves from the quarter chord to 0.5 - 0.175 (1 - 2 |alpha| / pi) chords behind the leading edge (Lindenburg,
///   Investigation into Rotor Blade Aerodynamics, ECN-C--03-025, 2003). The mass is taken to lie at its quarter chord.
/// - The tail, which is then what keeps the nose down, goes on with sin alpha.
/// - Each half of the wing meets the air at an angle of its own when it rolls. Their difference in lift takes the place
///   of roll damping: that of the derivative while both are attached (less 1/3 of the square of b p / (4 Va)), and the
///   opposite where lift falls with alpha: autorotation (Glauert, The rotation of an aeroplane about the axis of roll,
///   1919).
/// - Air along the wing lifts nothing: lift, drag, and moments of alpha are left with 1 - sin^4 of side-slip: all but
///   1e-3 of them up to 10 degrees, where the published models hold, and none broadside, where alpha has no meaning.
///   Of an endless wing it would be cos^2 (Jones, Effects of sweepback on boundary layer and separation, 1947).
Loads aerodynamics(const FixedWing& vehicle, const AirData& air, const Eigen::Vector3d& rates_radps,
                   const Surfaces& surfaces, double density_kgpm3, double height_m = no_ground_m);

/// Aerodynamics and propeller. `throttle` as it is, without limits.
Loads loads(const FixedWing& vehicle, const AirData& air, const Eigen::Vector3d& rates_radps, const Surfaces& surfaces,
            double throttle, double density_kgpm3, double height_m = no_ground_m);

/// The same for a vehicle in flight, throttle limited: force over mass is the specific force of an accelerometer in the
/// centre of mass.
Loads loads(const FixedWing& vehicle, const Environment& environment, const FixedWingState& state,
            const Controls& controls, const AirMotion& air, double height_m = no_ground_m);

/// Change with time of a body's state, surfaces being where they are. A pure function: the same arguments give the same
/// bits. `others`: loads besides its own, as of the ground; `height_m`: above it.
BodyVector derivative(const FixedWing& vehicle, const Environment& environment, const BodyVector& x,
                      const Surfaces& surfaces, double throttle, const AirMotion& air, const Loads& others = {},
                      double height_m = no_ground_m);

/// The state `dt_s` after `t_s`, by one Runge-Kutta step with controls held and the air and surfaces as they are at
/// each moment. Fails where the motion diverges.
Result<FixedWingState> advance(const FixedWing& vehicle, const Environment& environment, const FixedWingState& state,
                               const Controls& controls, const AirOverTime& air, double t_s, double dt_s);

}  // namespace nadir::sim
