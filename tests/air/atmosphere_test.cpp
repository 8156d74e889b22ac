#include "nadir/sim/atmosphere.h"

#include <gtest/gtest.h>

#include <cmath>

namespace nadir::sim {
namespace {

double geometric_m(double height_gp_m) { return height_gp_m * 6356766 / (6356766 - height_gp_m); }

TEST(StandardAir, AgreesWithTheTablesOfTheStandard) {
  // U.S. Standard Atmosphere, 1976, table 1, density by geometric height, each to its printed digits.
  struct Row {
    double height_m, density, digit;
  };
  for (const Row& row :
       {Row{0, 1.2250, 1e-4}, Row{1000, 1.1117, 1e-4}, Row{3000, 9.0925e-1, 1e-5}, Row{10000, 4.1351e-1, 1e-5},
        Row{15000, 1.9476e-1, 1e-5}, Row{25000, 4.0084e-2, 1e-6}, Row{50000, 1.0269e-3, 1e-7}})
    EXPECT_NEAR(Atmosphere().at(row.height_m).density_kgpm3, row.density, row.digit / 2) << row.height_m;
}

TEST(StandardAir, AgreesWithTheTablesByGeopotentialHeightFromBelowTheSeaToTwentyKilometres) {
  // The same air as ISO 2533 tabulates it, with one digit fewer than printed: its gas constant, 287.05287, differs from
  // that of 1976 by 3e-7.
  struct Row {
    double height_gp_m, temperature_k, pressure_hpa, pressure_digit, density, density_digit;
  };
  for (const Row& row :
       {Row{-2000, 301.15, 1277.7, 0.1, 1.4781, 1e-4}, Row{-1000, 294.65, 1139.3, 0.1, 1.3470, 1e-4},
        Row{0, 288.15, 1013.25, 0.01, 1.2250, 1e-4}, Row{1000, 281.65, 898.75, 0.01, 1.1116, 1e-4},
        Row{2000, 275.15, 794.95, 0.01, 1.0065, 1e-4}, Row{3000, 268.65, 701.09, 0.01, 0.90912, 1e-5},
        Row{5000, 255.65, 540.20, 0.01, 0.73612, 1e-5}, Row{8000, 236.15, 356.00, 0.01, 0.52517, 1e-5},
        Row{10000, 223.15, 264.36, 0.01, 0.41271, 1e-5}, Row{11000, 216.65, 226.32, 0.01, 0.36392, 1e-5},
        Row{12000, 216.65, 193.30, 0.01, 0.31083, 1e-5}, Row{15000, 216.65, 120.45, 0.01, 0.19367, 1e-5},
        Row{18000, 216.65, 75.048, 0.001, 0.12068, 1e-5}, Row{20000, 216.65, 54.749, 0.001, 0.088035, 1e-6}}) {
    SCOPED_TRACE(row.height_gp_m);
    EXPECT_NEAR(geopotential_height_m(geometric_m(row.height_gp_m)), row.height_gp_m, 1e-8);
    const Air air = Atmosphere().at(geometric_m(row.height_gp_m));
    EXPECT_NEAR(air.temperature_k, row.temperature_k, 1e-9);
    EXPECT_NEAR(air.pressure_pa, row.pressure_hpa * 100, row.pressure_digit * 100 / 2);
    EXPECT_NEAR(air.density_kgpm3, row.density, row.density_digit / 2);
  }
}

TEST(StandardAir, HasTheBasePressuresOfTheStandard) {
  // Table 4 and equation 33 of the standard; as printed there, to seven digits.
  for (const auto& [height_gp_m, pressure_pa] : {std::pair{11000.0, 22632.06},
                                                 {20000.0, 5474.889},
                                                 {32000.0, 868.0187},
                                                 {47000.0, 110.9063},
                                                 {51000.0, 66.93887},
                                                 {71000.0, 3.956420}})
    EXPECT_NEAR(Atmosphere().at(geometric_m(height_gp_m)).pressure_pa / pressure_pa, 1, 2e-7) << height_gp_m;
}

TEST(StandardAir, IsContinuousAcrossLayersAndThinsOutWithoutEnd) {
  for (const AtmosphereOffsets& offsets : {AtmosphereOffsets{}, {-60, -15000}, {60, 15000}}) {
    const Atmosphere atmosphere(offsets);
    for (const double border_gp : {11000.0, 20000.0, 32000.0, 47000.0, 51000.0, 71000.0, 84852.0}) {
      const double border_m = geometric_m(border_gp);
      const double below = atmosphere.at(border_m - 1e-3).pressure_pa,
                   above = atmosphere.at(border_m + 1e-3).pressure_pa;
      EXPECT_NEAR(above / below, 1, 1e-6) << border_gp << ": 2 mm are 4e-7 of pressure at the thinnest";
    }
    for (double h = -1000; h < 1e6; h *= h < 0 ? -1.0 : 1.1) {
      const double here = atmosphere.at(h).density_kgpm3;
      EXPECT_GE(here, atmosphere.at(h + 500).density_kgpm3);
      EXPECT_TRUE(std::isfinite(here) && here >= 0) << h;
    }
  }
}

TEST(OffsetAir, IsInHydrostaticBalanceAtItsOwnTemperature) {
  // dp/dH = -g0 rho, by central differences over 2 m: error of third order, 1e-9 of the gradient.
  const AtmosphereOffsets offsets{.temperature_k = 17.5, .pressure_pa = -1800};
  const Atmosphere day(offsets), standard;
  EXPECT_DOUBLE_EQ(day.at(0).pressure_pa, 101325 - 1800);
  for (const double height_gp_m : {-500.0, 100.0, 5000.0, 10900.0, 11500.0, 19000.0, 30000.0}) {
    const double above = day.at(geometric_m(height_gp_m + 1)).pressure_pa,
                 below = day.at(geometric_m(height_gp_m - 1)).pressure_pa;
    const Air here = day.at(geometric_m(height_gp_m));
    EXPECT_NEAR((above - below) / 2 / (-9.80665 * here.density_kgpm3), 1, 1e-7) << height_gp_m;
    EXPECT_NEAR(here.temperature_k - standard.at(geometric_m(height_gp_m)).temperature_k, 17.5, 1e-9);
  }
  EXPECT_GT(day.at(10000).pressure_pa, standard.at(10000).pressure_pa) << "warm air holds its pressure farther up";
}

TEST(OffsetAir, RefusesWhatNoWeatherMakes) {
  EXPECT_TRUE(Atmosphere::check({.temperature_k = -60, .pressure_pa = 15000}));
  for (const AtmosphereOffsets& bad : {AtmosphereOffsets{288.15, 0}, {0, 101325}, {std::nan(""), 0}, {0, std::nan("")}})
    EXPECT_FALSE(Atmosphere::check(bad)) << bad.temperature_k << " K, " << bad.pressure_pa << " Pa";
}

}  // namespace
}  // namespace nadir::sim
