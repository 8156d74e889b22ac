#pragma once

#include <array>

#include "nadir/base/result.h"

namespace nadir::sim {

/// Air at rest at one height.
struct Air {
  double temperature_k = 288.15;
  double pressure_pa = 101325;
  double density_kgpm3 = 1.225;
};

/// How a day differs from the standard one.
struct AtmosphereOffsets {
  double temperature_k = 0;  // of all heights
  double pressure_pa = 0;    // at mean sea level
};

/// International Standard Atmosphere of 1976, or of a warmer or colder day: temperatures are those of the standard plus
/// an offset, and pressure is what the weight of that air makes of the one at sea level. Below the sea the lowest layer
/// continues; above 84.852 km (geopotential) the air is taken as isothermal, where there is hardly any left.
/// Error: under 1e-6 of the tables' pressure up to 84 km. Cheap to copy; safe to share.
/// Source: U.S. Standard Atmosphere, 1976, table 4 and equations 18, 23, 33a, 33b, 42.
class Atmosphere {
 public:
  Atmosphere() : Atmosphere(AtmosphereOffsets{}) {}
  /// `offsets`: such that `check` has no fault with them.
  explicit Atmosphere(const AtmosphereOffsets& offsets);

  /// Refuses offsets of more than 60 K or 15 kPa, wider than any weather: a unit is mistaken.
  static Result<void> check(const AtmosphereOffsets& offsets);

  /// `height_m`: geometric, above mean sea level.
  Air at(double height_m) const;

 private:
  struct Layer {
    double base_m = 0;      // geopotential height
    double base_k = 0;      // temperature there
    double lapse_kpm = 0;   // kelvin per metre upwards
    double base_kgpm3 = 0;  // density there
    double per_base_k = 0, density_exponent = 0;
    double density_ratio(double height_gp_m, double temperature_share) const;
  };
  static Air at_geopotential(const Layer& layer, double height_gp_m);
  std::array<Layer, 8> layers_;
};

/// Geopotential height of the standard, metres, from the geometric one.
double geopotential_height_m(double height_m);

}  // namespace nadir::sim
