#pragma once

#include "nadir/sim/flight.h"
#include "nadir/sim/flown_fixed_wing.h"

namespace nadir::bench {

/// An Aerosonde around a square of 1 km for ever, two corners 20 m higher, 3000 m up over WGS-84, in wind; in light
/// turbulence too where that is wanted.
sim::Flight aerosonde_around_a_square(const sim::Scheme& scheme, bool turbulent);

/// A multirotor of 3.5 kg around a square of 60 m at 5 m/s for ever, 50 m up over the ground that it could land on, in
/// wind: on motors that follow at once; or on rotors with inertia, which a battery of 6 cells drives.
sim::Flight multirotor_around_a_square(const sim::Scheme& scheme, bool motors_and_battery);

/// In a level circle of 150 m, in still air, for ever; steps that adapt.
sim::Flight aerosonde_in_a_circle();

/// Air of the square alone, and where it begins.
sim::AirAlongPath air_of_the_square(bool turbulent);
sim::PathPoint start_of_the_square();
/// Its vehicle and autopilot alone.
std::unique_ptr<sim::FlownVehicle> vehicle_of_the_square(const sim::Scheme& scheme);

/// Greatest distance of two states: of their places, or of what lies a kilometre away along their attitudes. Metres.
double apart_m(const sim::BodyState& a, const sim::BodyState& b);

}  // namespace nadir::bench
