#pragma once

#include <span>
#include <vector>

#include "nadir/sim/mission.h"

namespace nadir::sim {

struct MissionLayout {
  std::vector<MissionPiece> pieces;
  std::vector<MissionFault> faults;
  std::size_t again = 0;  // the piece to go on with after the last one, where the mission repeats
};

/// Lays the path out, or tells what forbids it: then there are no pieces.
MissionLayout lay_out(const Waypoint& start, std::span<const MissionItem> items, double turn_radius_m,
                      AfterMission after);

}  // namespace nadir::sim
