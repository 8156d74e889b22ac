#include "nadir/geodesy/height.h"

#include <gtest/gtest.h>

namespace nadir::geodesy {
namespace {

TEST(ParseHeight, TakesADatumAndRefusesOthers) {
  EXPECT_EQ(parse_height("120").value().datum, HeightDatum::Ellipsoid);
  const auto agl = parse_height(" 3000 agl ").value();
  EXPECT_EQ(agl.value_m, 3000);
  EXPECT_EQ(agl.datum, HeightDatum::Agl);
  EXPECT_EQ(parse_height("-12.5 msl").value().datum, HeightDatum::Msl);
  const auto bad = parse_height("12 mls");
  ASSERT_FALSE(bad);
  EXPECT_NE(bad.error().message.find("did you mean 'msl'"), std::string::npos) << bad.error().message;
  EXPECT_FALSE(parse_height("high"));
}

TEST(Geoid, HasTheHeightThatNgaPublishes) {
  // Test values of the EGM96 program F477 (NGA): 38.6281550 N, 269.7791550 E: -31.628 m; -14.6212170, 305.0211140:
  // -2.969 m. The 15' grid is within a decimetre or so of the full model in such smooth places.
  EXPECT_NEAR(geoid_height_m(to_radians(38.6281550), to_radians(269.7791550 - 360)).value(), -31.628, 0.2);
  EXPECT_NEAR(geoid_height_m(to_radians(-14.6212170), to_radians(305.0211140 - 360)).value(), -2.969, 0.2);
}

TEST(EllipsoidalHeight, AddsTheGeoidOrTheGround) {
  const double lat = to_radians(38.6281550), lon = to_radians(-90.220845);
  EXPECT_EQ(ellipsoidal_height_m({100, HeightDatum::Ellipsoid}, lat, lon, 50).value(), 100);
  EXPECT_EQ(ellipsoidal_height_m({100, HeightDatum::Agl}, lat, lon, 50).value(), 150);
  EXPECT_NEAR(ellipsoidal_height_m({100, HeightDatum::Msl}, lat, lon, 50).value(), 68.4, 0.2)
      << "the geoid lies below the ellipsoid there";
}

}  // namespace
}  // namespace nadir::geodesy
