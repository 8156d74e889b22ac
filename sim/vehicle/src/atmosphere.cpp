#include "nadir/sim/atmosphere.h"

#include <array>
#include <cmath>

namespace nadir::sim {
namespace {

struct Layer {
  double base_m;     // geopotential height
  double base_k;     // temperature there
  double lapse_kpm;  // kelvin per metre upwards
  double base_pa;    // pressure there
};
constexpr std::array<Layer, 8> layers{{
    {0, 288.15, -0.0065, 101325.0},
    {11000, 216.65, 0, 22632.06},
    {20000, 216.65, 0.001, 5474.889},
    {32000, 228.65, 0.0028, 868.0187},
    {47000, 270.65, 0, 110.9063},
    {51000, 270.65, -0.0028, 66.93887},
    {71000, 214.65, -0.002, 3.956420},
    {84852, 186.946, 0, 0.3733836},
}};

constexpr double earth_radius_m = 6356766;       // of the standard's geopotential height
constexpr double gas_jpkgk = 8314.32 / 28.9644;  // of dry air
constexpr double gravity_per_gas_kpm = 9.80665 / gas_jpkgk;

}  // namespace

Air standard_air(double height_m) {
  const double height_gp = earth_radius_m * height_m / (earth_radius_m + height_m);
  const Layer* layer = &layers[0];
  for (const Layer& higher : layers)
    if (height_gp >= higher.base_m) layer = &higher;

  const double above_m = height_gp - layer->base_m;
  Air air;
  air.temperature_k = layer->base_k + layer->lapse_kpm * above_m;
  if (layer->lapse_kpm == 0)
    air.pressure_pa = layer->base_pa * std::exp(-gravity_per_gas_kpm * above_m / layer->base_k);
  else
    air.pressure_pa =
        layer->base_pa * std::pow(layer->base_k / air.temperature_k, gravity_per_gas_kpm / layer->lapse_kpm);
  air.density_kgpm3 = air.pressure_pa / (gas_jpkgk * air.temperature_k);
  return air;
}

}  // namespace nadir::sim
