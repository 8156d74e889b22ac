#include <cmath>
#include <numbers>

#include "nadir/sim/multirotor.h"

namespace nadir::sim {
namespace {

using Eigen::Vector3d;

MassProperties mass_of(double mass_kg, double jxx, double jyy, double jzz) {
  return MassProperties::create(mass_kg, {.jxx_kgm2 = jxx, .jyy_kgm2 = jyy, .jzz_kgm2 = jzz}).value();
}

}  // namespace

GroundEffect published_ground_effect() {
  return {.law = GroundEffect::Law::Polynomial, .force_n = {-55.3516, 181.8265, -203.9874, 85.3735, -7.6619}};
}

Multirotor rosflight_multirotor() {
  Multirotor m;
  m.mass = mass_of(3.5, 0.08, 0.08, 0.12);
  const ElectricDrive drive{.propulsion = {.diameter_m = 0.381,
                                           .ct0 = 0.08729101,
                                           .ct1 = -0.11006411,
                                           .ct2 = -0.12928596,
                                           .cq0 = 0.00428594,
                                           .cq1 = 0.00146105,
                                           .cq2 = -0.01440988,
                                           .kq_vspr = 0.028937,
                                           .max_voltage_v = 24,
                                           .resistance_ohm = 0.042,
                                           .no_load_current_a = 1.5},
                            .dynamics = {}};
  for (int i = 0; i < 4; ++i) {
    const double angle = (0.25 + 0.5 * i) * std::numbers::pi;
    Rotor rotor;
    rotor.position_m = 0.25 * Vector3d(std::cos(angle), std::sin(angle), 0);
    rotor.clockwise = i % 2 == 1;  // front right and rear left turn against the clock
    rotor.drive = drive;
    m.rotors.push_back(rotor);
  }
  m.drag = {.coefficient = 2.05, .area_m2 = 0.04, .induced_spm = 0.05};
  m.ground_effect.law = GroundEffect::Law::CheesemanBennett;
  return m;
}

Multirotor rosflight_sil_multirotor() {
  Multirotor m;
  const double share = 2.0 / 3.5;
  m.mass = mass_of(2.0, 0.08 * share, 0.08 * share, 0.12 * share);
  const PulseDrive drive{.thrust_n = {1.5e-5, -0.024451, 9.00225},
                         .torque_nm = {2.22e-7, -3.51e-4, 0.12531},
                         .max_thrust_n = 14.961,
                         .radius_m = 0.127};
  const Vector3d places[] = {
      {0.1926, 0.230, -0.0762}, {-0.1907, 0.205, -0.0762}, {-0.1907, -0.205, -0.0762}, {0.1926, -0.230, -0.0762}};
  const Vector3d axes[] = {{-0.02674078, 0.0223925, -0.99939157},
                           {0.02553726, 0.02375588, -0.99939157},
                           {0.02553726, -0.02375588, -0.99939157},
                           {-0.02674078, -0.0223925, -0.99939157}};
  for (int i = 0; i < 4; ++i)
    m.rotors.push_back({.position_m = places[i],
                        .thrust_axis = axes[i].normalized(),
                        .clockwise = i % 2 == 1,
                        .drive = drive,
                        .rise_time_constant_s = 0.2164,
                        .fall_time_constant_s = 0.1644});
  m.drag = {.linear_nspm = 0.2, .angular_nms = 0.0005};
  m.ground_effect.law = GroundEffect::Law::CheesemanBennett;
  return m;
}

Multirotor roscopter_multirotor() {
  Multirotor m;
  m.mass = mass_of(3.69, 0.07, 0.08, 0.12);
  m.lumped = LumpedRotors{.max_thrust_n = 59.844,
                          .max_moment_nm = {6.508, 5.087, 0.25},
                          .rise_time_constant_s = {0.1644, 0.1904, 0.1904, 0.1644},
                          .fall_time_constant_s = {0.2164, 0.1904, 0.1904, 0.2164},
                          .rotor_radius_m = 0.127};
  m.drag = {.linear_nspm = 0.2, .angular_nms = 0.3};
  m.ground_effect.law = GroundEffect::Law::CheesemanBennett;
  return m;
}

}  // namespace nadir::sim
