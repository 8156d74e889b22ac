#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nadir/base/yaml.h"
#include "nadir/sim/atmosphere.h"
#include "nadir/sim/gust.h"
#include "nadir/sim/map_wind.h"
#include "nadir/sim/turbulence.h"
#include "nadir/sim/wind.h"

namespace nadir::sim {

/// Rough air, by one of the two.
struct TurbulenceSetup {
  std::optional<TurbulenceIntensity> intensity;
  double wind_mps = 0;  // at 20 ft, where no intensity is named

  double wind_at_20ft_mps() const { return intensity ? sim::wind_at_20ft_mps(*intensity) : wind_mps; }
};

/// A map of wind.
struct FieldSetup {
  std::string map;
  std::vector<std::string> bands;  // towards east, towards north; the first two where empty
  MapWind::Outside outside = MapWind::Outside::Edge;
};

/// `air:` of a run file: how the air moves, and what day it is. All that moves it adds up.
struct AirSetup {
  double wind_from_deg = 0, wind_speed_mps = 0, wind_up_mps = 0;  // at the reference height where there is shear
  Shear shear;
  std::vector<Gust> gusts;
  std::optional<TurbulenceSetup> turbulence;
  AtmosphereOffsets atmosphere;
  std::optional<FieldSetup> field;
};

/// Notes faults in `yaml`.
AirSetup read_air(const YamlMap& yaml);

/// The section complete with defaults. `field_path`: of its map, from anywhere.
std::string air_text(const AirSetup& air, const std::string& field_path);

}  // namespace nadir::sim
