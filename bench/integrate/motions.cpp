#include "motions.h"

#include <cmath>
#include <numbers>
#include <vector>

#include "nadir/sim/multirotor_motion.h"
#include "nadir/sim/multirotor_trim.h"
#include "nadir/sim/trim.h"
#include "nadir/sim/vehicle_file.h"

namespace nadir::bench {
namespace {
constexpr double pi = std::numbers::pi;

const char* name_of(Flight flight) {
  switch (flight) {
    case Flight::Cruise:
      return "cruise, 10 s";
    case Flight::Roll:
      return "rolls and a pull, 10 s";
    case Flight::Stall:
      return "stall and spin, 10 s";
    case Flight::Gust:
      return "gust, 10 s";
    case Flight::Drop:
      break;
  }
  return "from rest, 10 s";
}
}  // namespace

Motion<2> harmonic() {
  return {.name = "harmonic, 1 Hz, 20 turns",
          .start = {1, 0},
          .interval_s = 0.1,
          .intervals = 200,
          .derivative_of =
              [](int) {
                return [](double, const Eigen::Vector2d& x) -> Eigen::Vector2d { return {x[1], -4 * pi * pi * x[0]}; };
              },
          .counted = {1, 0},
          .unit = "m",
          .one = {1, 1}};
}

Motion<7> rigid_body() {
  using Vector = Motion<7>::Vector;
  Motion<7> motion{.name = "rigid body, tumbling",
                   .start = Vector::Zero(),
                   .interval_s = 0.05,
                   .intervals = 400,
                   .derivative_of =
                       [](int) {
                         return [](double, const Vector& x) {
                           const Eigen::Vector3d inertia(0.8, 1.1, 1.8), w = x.head<3>();
                           const Eigen::Quaterniond q(x[6], x[3], x[4], x[5]);
                           Vector change;
                           change << -w.cross(inertia.cwiseProduct(w)).cwiseQuotient(inertia),
                               (q * Eigen::Quaterniond(0, 0.5 * w.x(), 0.5 * w.y(), 0.5 * w.z())).coeffs();
                           return change;
                         };
                       },
                   .counted = Vector::Zero(),
                   .unit = "rad/2",
                   .one = Vector::Ones()};
  motion.start << 0.1, 3, 0.1, 0, 0, 0, 1;
  motion.counted.tail<4>().setOnes();
  return motion;
}

Motion<2> motor() {
  return {.name = "motor, 0.2 ms, at 100 Hz",
          .start = {20, 300},
          .interval_s = 0.01,
          .intervals = 200,
          .derivative_of =
              [](int i) {
                const double voltage = 30 + 6 * std::sin(2 * pi * i / 80) + (i % 40 < 20 ? 4 : 0);
                return [=](double, const Eigen::Vector2d& x) -> Eigen::Vector2d {
                  constexpr double resistance = 0.042, inductance = 2e-4 * resistance, torque = 0.06586;
                  constexpr double inertia = 2.4 * torque * torque / resistance, propeller = 2.4e-6;
                  return {(voltage - resistance * x[0] - torque * x[1]) / inductance,
                          (torque * x[0] - propeller * x[1] * std::abs(x[1])) / inertia};
                };
              },
          .counted = {1, 1},
          .unit = "A, rad/s",
          .one = {1, 1},
          .most_steps = 128};
}

Motion<4> landing_gear() {
  using Eigen::Vector4d;
  return {.name = "landing gear, 1e6 N/m",
          .start = Vector4d(0.6, 0, 0.1, 0),
          .interval_s = 0.0025,
          .intervals = 400,
          .derivative_of =
              [](int) {
                return [](double, const Vector4d& x) -> Vector4d {
                  constexpr double body_kg = 11, wheel_kg = 0.1, length_m = 0.5, g = 9.81;
                  const double strut_n = 8000 * (length_m - (x[0] - x[2])) - 400 * (x[1] - x[3]);
                  // The tyre's damping goes with its depth, so that the force begins at zero, and it never pulls
                  const double depth_m = std::max(0.0, -x[2]);
                  const double tyre_n = std::max(0.0, 1e6 * depth_m * (1 - 0.5 * x[3]));
                  return {x[1], strut_n / body_kg - g, x[3], (tyre_n - strut_n) / wheel_kg - g};
                };
              },
          .counted = Vector4d(1, 0, 1, 0),
          .unit = "m",
          .one = Vector4d::Ones()};
}

Motion<13> aerosonde_in(Flight flight) {
  using namespace sim;
  const auto place = geodesy::Geodetic::degrees(38.1, -0.76, 3000);
  const FixedWing vehicle = fixed_wing_model("aerosonde").value();
  const Environment air = Environment::wgs84();
  const auto steady = trim(vehicle, {.airspeed_mps = 25}, air, place);
  const Trim cruise = steady.value();
  FixedWingState state = trimmed_state(cruise, air, place, 0.5, Eigen::Vector3d::Zero());
  if (flight == Flight::Drop) state.velocity.xyz.setZero();
  Motion<13> motion{
      .name = name_of(flight), .start = to_vector(state), .interval_s = 0.01, .intervals = 1000, .unit = "m"};
  const Eigen::Vector3d origin = motion.start.head<3>();
  motion.start.head<3>().setZero();

  const auto controls_at = [=](int i) {
    Controls controls = cruise.controls;
    if (flight == Flight::Roll) {  // two turns of the roll, and a pull
      controls.surfaces.aileron_rad += i < 300 ? 0.3 : i < 600 ? -0.3 : 0;
      controls.surfaces.elevator_rad -= i > 300 && i < 500 ? 0.1 : 0;
    } else if (flight == Flight::Stall) {  // a slow pull up to the stop, and rudder
      controls.throttle = 0.3;
      controls.surfaces.elevator_rad = std::max(-0.6, controls.surfaces.elevator_rad - 0.002 * i);
      controls.surfaces.rudder_rad = i > 300 ? 0.3 : 0;
    } else if (flight == Flight::Drop) {
      controls.throttle = 0;
    }
    return controls;
  };
  const auto wind_at = [=](double t_s) -> Eigen::Vector3d {
    if (flight != Flight::Gust || t_s < 1 || t_s > 3) return Eigen::Vector3d::Zero();
    return 0.5 * (1 - std::cos(pi * (t_s - 1))) * Eigen::Vector3d(2, 4, -5);  // 1-cosine, 2 s long
  };
  std::vector<Surfaces> surfaces = {state.surfaces};  // where intervals begin
  for (int i = 0; i + 1 < motion.intervals; ++i)
    surfaces.push_back(surfaces_after(vehicle, surfaces.back(), controls_at(i).surfaces, motion.interval_s));
  motion.derivative_of = [=, interval_s = motion.interval_s](int i) {
    const Controls controls = controls_at(i);
    const double from_s = i * interval_s;
    return [=, from = surfaces[static_cast<std::size_t>(i)]](double t_s, const BodyVector& x) {
      BodyVector there = x;
      there.head<3>() += origin;
      return derivative(vehicle, air, there, surfaces_after(vehicle, from, controls.surfaces, t_s - from_s),
                        controls.throttle, wind_at(t_s));
    };
  };
  motion.counted.setZero();
  motion.counted.head<3>().setOnes();
  // A metre, a metre a second, a tenth of attitude and of rates
  motion.one << 1, 1, 1, 1, 1, 1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1;
  motion.most_steps = 16;
  return motion;
}

namespace {

template <int n>
Motion<n> hover_of(const char* name, const sim::Multirotor& vehicle) {
  using namespace sim;
  using Vector = typename Motion<n>::Vector;
  const auto place = geodesy::Geodetic::degrees(38.1, -0.76, 100);
  const Environment earth = Environment::wgs84();
  const Surroundings here = earth.at(geodesy::ecef_from_geodetic(place));
  const MultirotorTrim steady =
      trim(vehicle, {}, here.density_kgpm3, here.gravity_ecef_mps2.norm(), /*charge_ah=*/0).value();
  const MultirotorState state =
      trimmed_state(vehicle, steady, earth, place, 0.5, Eigen::Vector3d::Zero(), /*charge_ah=*/0);
  Motion<n> motion{.name = name,
                   .start = to_vector(vehicle, state, CurrentModel::Integrated),
                   .interval_s = 0.01,
                   .intervals = 500,
                   .counted = Vector::Zero(),
                   .unit = "m",
                   .one = Vector::Ones(),
                   .most_steps = 64};
  const Eigen::Vector3d origin = motion.start.template head<3>();
  motion.start.template head<3>().setZero();
  motion.counted.template head<3>().setOnes();
  motion.one.template segment<4>(body_quaternion_at).setConstant(0.1);

  motion.derivative_of = [=](int i) {
    MultirotorControls controls = steady.controls;
    for (Eigen::Index rotor = 0; rotor < controls.actuators.size(); ++rotor)
      controls.actuators[rotor] *= 1 + 0.02 * std::sin(2 * pi * i / (80.0 + 10 * static_cast<double>(rotor)));
    return [=](double t_s, const Vector& x) -> Vector {
      const AirOverTime still;
      const MultirotorMotion moves(vehicle, earth, state, controls, still, 0, CurrentModel::Integrated);
      Vector there = x;
      there.template head<3>() += origin;
      if constexpr (n == 13) {
        return moves(t_s, there);
      } else {
        MultirotorVector change;
        moves(t_s, MultirotorVector(there), change);
        return change;
      }
    };
  };
  return motion;
}

}  // namespace

Motion<13> hover() { return hover_of<13>("hover, 5 s", sim::multirotor_model("multirotor").value()); }

Motion<21> hover_with_windings() {
  sim::Multirotor vehicle = sim::multirotor_model("multirotor").value();
  for (sim::Rotor& rotor : vehicle.rotors) {
    auto& drive = std::get<sim::ElectricDrive>(rotor.drive);
    drive.dynamics = {.rotor_inertia_kgm2 = 2e-4, .inductance_h = 2e-4 * drive.propulsion.resistance_ohm};
  }
  return hover_of<21>("hover, windings of 0.2 ms, 5 s", vehicle);
}

}  // namespace nadir::bench
