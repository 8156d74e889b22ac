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
  friend bool operator==(const Propulsion&, const Propulsion&) = default;
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

/// The propeller alone, at a rate that something else says.
PropulsionOutput propeller_at(const Propulsion& propulsion, double omega_radps, double airspeed_mps,
                              double density_kgpm3);

/// What a motor that turns at `omega_radps` draws once its current has settled; negative where it brakes.
double settled_current_a(const Propulsion& propulsion, double voltage_v, double omega_radps);

/// The throttle at which a propeller turns at `omega_radps`; not limited.
double throttle_at(const Propulsion& propulsion, double omega_radps, double airspeed_mps, double density_kgpm3);

/// What a motor has beyond the balance of torques.
struct MotorDynamics {
  double rotor_inertia_kgm2 = 0;  // of rotor and propeller about the shaft; 0: speed follows at once
  double inductance_h = 0;        // of the winding; 0: current follows at once
  friend bool operator==(const MotorDynamics&, const MotorDynamics&) = default;
};

/// Inductance over resistance.
double electrical_time_constant_s(const Propulsion& propulsion, const MotorDynamics& dynamics);

/// Of a speed back to that of the balance, at a speed, with the current settled.
double mechanical_time_constant_s(const Propulsion& propulsion, const MotorDynamics& dynamics, double omega_radps,
                                  double density_kgpm3);

/// How fast the speed changes, rad/s^2, under a current and a propeller's torque. Friction stops, and does not turn
/// backwards.
double spin_change(const Propulsion& propulsion, const MotorDynamics& dynamics, double omega_radps, double current_a,
                   double torque_nm);
/// How fast the current changes, A/s.
double current_change(const Propulsion& propulsion, const MotorDynamics& dynamics, double voltage_v, double omega_radps,
                      double current_a);

/// How fast the speed changes where the current is taken as settled, though it has an inductance: what current lags
/// behind, L/R times its own change, is back-EMF of the speed's change, and acts as a little less inertia. Error: of
/// the square of the electrical time constant over the mechanical one, and a delay of the former after a jump of
/// voltage. Source: Kokotovic, Khalil and O'Reilly, Singular Perturbation Methods in Control, 1986, section 2.2 (the
/// slow manifold to first order).
double settled_spin_change(const Propulsion& propulsion, const MotorDynamics& dynamics, double voltage_v,
                           double omega_radps, double torque_nm);

}  // namespace nadir::sim
