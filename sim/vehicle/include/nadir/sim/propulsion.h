#pragma once

namespace nadir::sim {

/// An electric motor with a fixed-pitch propeller. Thrust and torque coefficients are quadratics of the advance ratio
/// J = 2 pi Va / (omega D): C(J) = c0 + c1 J + c2 J^2.
struct Propulsion {
  double diameter_m = 0;
  double ct0 = 0, ct1 = 0, ct2 = 0;  // thrust, per rho n^2 D^4
  double cq0 = 0, cq1 = 0, cq2 = 0;  // torque, per rho n^2 D^5; cq0 > 0
  double kq_vspr = 0;                // torque and back-EMF constant, V s/rad = N m/A
  double max_voltage_v = 0;          // at full throttle
  double resistance_ohm = 0;         // > 0
  double no_load_current_a = 0;
};

/// What motor and propeller do in one moment.
struct PropulsionOutput {
  double omega_radps = 0;  // never negative: friction stops a propeller, it does not turn it backwards
  double thrust_n = 0;     // forward; negative where the propeller windmills
  double torque_nm = 0;    // on the propeller; the airframe feels the opposite
};

/// At the speed where the motor's torque equals the propeller's. `throttle`: share of the voltage; commands are in
/// [0, 1], and a solver may ask beyond.
/// Source: Beard and McLain, Small Unmanned Aircraft, supplement to section 4.3; rosflight_sim (ROS 2) has the same.
PropulsionOutput propel(const Propulsion& propulsion, double throttle, double airspeed_mps, double density_kgpm3);

}  // namespace nadir::sim
