#include "nadir/sim/atmosphere.h"

#include <fmt/format.h>

#include <cmath>

namespace nadir::sim {
namespace {

constexpr double earth_radius_m = 6356766;       // of the standard's geopotential height
constexpr double gas_jpkgk = 8314.32 / 28.9644;  // of dry air
constexpr double gravity_per_gas_kpm = 9.80665 / gas_jpkgk;

}  // namespace

double geopotential_height_m(double height_m) { return earth_radius_m * height_m / (earth_radius_m + height_m); }

Result<void> Atmosphere::check(const AtmosphereOffsets& offsets) {
  if (!(std::abs(offsets.temperature_k) <= 60))
    return fail(Error::Kind::Malformed,
                fmt::format("temperature: expected at most 60 K from the standard, found {}", offsets.temperature_k));
  if (!(std::abs(offsets.pressure_pa) <= 15000))
    return fail(Error::Kind::Malformed,
                fmt::format("pressure: expected at most 15000 Pa from the standard, found {}", offsets.pressure_pa));
  return {};
}

/// Of the density at a height in the layer to that at its base.
double Atmosphere::Layer::density_ratio(double height_gp_m, double temperature_share) const {
  if (lapse_kpm == 0) return std::exp(-gravity_per_gas_kpm * (height_gp_m - base_m) * per_base_k);
  // A power whose exponent is small: two units in the last place, in two thirds of the time of std::pow
  return std::exp(density_exponent * std::log(temperature_share));
}

Atmosphere::Atmosphere(const AtmosphereOffsets& offsets)
    : layers_{{{0, 288.15, -0.0065},
               {11000, 216.65, 0},
               {20000, 216.65, 0.001},
               {32000, 228.65, 0.0028},
               {47000, 270.65, 0},
               {51000, 270.65, -0.0028},
               {71000, 214.65, -0.002},
               {84852, 186.946, 0}}} {
  for (Layer& layer : layers_) {
    layer.base_k += offsets.temperature_k;
    layer.per_base_k = 1 / layer.base_k;
    if (layer.lapse_kpm != 0) layer.density_exponent = -gravity_per_gas_kpm / layer.lapse_kpm - 1;
  }
  layers_[0].base_kgpm3 = (101325 + offsets.pressure_pa) / (gas_jpkgk * layers_[0].base_k);
  for (std::size_t i = 1; i < layers_.size(); ++i)
    layers_[i].base_kgpm3 = at_geopotential(layers_[i - 1], layers_[i].base_m).density_kgpm3;
}

Air Atmosphere::at_geopotential(const Layer& layer, double height_gp_m) {
  Air air;
  air.temperature_k = layer.base_k + layer.lapse_kpm * (height_gp_m - layer.base_m);
  air.density_kgpm3 = layer.base_kgpm3 * layer.density_ratio(height_gp_m, air.temperature_k * layer.per_base_k);
  air.pressure_pa = air.density_kgpm3 * (gas_jpkgk * air.temperature_k);
  return air;
}

Air Atmosphere::at(double height_m) const {
  const double height_gp_m = geopotential_height_m(height_m);
  std::size_t layer = 0;
  while (layer + 1 < layers_.size() && height_gp_m >= layers_[layer + 1].base_m) ++layer;
  return at_geopotential(layers_[layer], height_gp_m);
}

}  // namespace nadir::sim
