#pragma once

#include "nadir/sim/fixed_wing.h"
#include "nadir/sim/ground_contact.h"

namespace nadir::sim {

/// A fixed wing and the ground.
using FixedWingGround = GroundContact<BodyVector>;
FixedWingGround ground_for(const FixedWing& vehicle, std::shared_ptr<const Ground> ground,
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
