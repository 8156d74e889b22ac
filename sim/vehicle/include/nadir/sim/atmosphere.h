#pragma once

namespace nadir::sim {

/// Air at rest at one height.
struct Air {
  double temperature_k = 288.15;
  double pressure_pa = 101325;
  double density_kgpm3 = 1.225;
};

/// International Standard Atmosphere. `height_m`: geometric, above mean sea level; below it the lowest layer continues,
/// and above 86 km the air is taken as isothermal, where there is hardly any left.
/// Error: that of the tabulated base pressures, under 1e-6 of the value, up to 84 km.
/// Source: U.S. Standard Atmosphere, 1976, table 4 and equations 18, 23, 33a, 33b, 42.
Air standard_air(double height_m);

}  // namespace nadir::sim
