#pragma once

#include "nadir/sim/fixed_wing.h"
#include "nadir/sim/ground_contact.h"

namespace nadir::sim {

/// A tricycle gear of our own for `aerosonde`, which has none in its source: 30 cm under the centre of mass, a steered
/// nose wheel half a metre in front of it and braked main wheels 7 cm behind and 35 cm beside it. Main springs give by
/// 12 mm under the weight and swing at 30 rad/s with 0.3 of critical damping; they break at 1000 N, of a touch-down at
/// about 3.5 m/s. Wing tips, nose, belly and tail may not touch: that is at 14 degrees of bank, and 13 of pitch.
ContactGear aerosonde_gear();

/// A fixed wing and the ground.
using FixedWingGround = GroundContact<BodyVector>;
FixedWingGround ground_for(const FixedWing& vehicle, ContactGear gear, std::shared_ptr<const Ground> ground,
                           const Environment& environment);

/// As `advance` without ground, over it and on it: that one's steps where no point of the gear can come to the ground.
struct FixedWingStep {
  FixedWingState state;
  ContactState contact;
  ContactReport report;
};
/// Adds to `work` what the ground cost.
Result<FixedWingStep> advance(const FixedWing& vehicle, const Environment& environment, const FixedWingGround& ground,
                              const FixedWingState& state, const ContactState& contact, const Controls& controls,
                              const GearCommand& gear, const AirOverTime& air, double t_s, double dt_s,
                              ContactWork& work);

/// A vehicle that stands on its gear at rest (`standing_body`). What its springs give by is left for the first tenths
/// of a second.
FixedWingState standing_state(const Environment& environment, const ContactGear& gear, const Ground& ground,
                              const geodesy::Geodetic& place, double yaw_rad);

}  // namespace nadir::sim
