#include "nadir/base/text.h"

#include <gtest/gtest.h>

#include <array>

namespace nadir {
namespace {

TEST(NearestName, FindsTheNameThatWasMistyped) {
  constexpr std::array<std::string_view, 3> names = {"lat_deg", "lon_deg", "height_m"};
  EXPECT_EQ(nearest_name("lat_dge", names), "lat_deg");
  EXPECT_EQ(nearest_name("heigth_m", names), "height_m");
  EXPECT_EQ(nearest_name("temperature", names), "") << "nothing near: better no advice than a wrong one";
}

TEST(ParseSeconds, KeepsEveryNanosecond) {
  EXPECT_EQ(parse_seconds_as_ns("0.1").value(), 100'000'000);
  EXPECT_EQ(parse_seconds_as_ns("1750000000.123456789").value(), 1'750'000'000'123'456'789)
      << "a double would lose the last digits";
  EXPECT_EQ(parse_seconds_as_ns("-2.5").value(), -2'500'000'000);
  EXPECT_EQ(parse_seconds_as_ns("9223372036.854775807").value(), INT64_MAX);
}

TEST(ParseSeconds, RefusesWhatItCannotKeep) {
  for (const char* bad : {"", ".", "1.2.3", "1e3", "0x10", "1.0000000001", "9223372036.854775808", "nan", "12 s"})
    EXPECT_FALSE(parse_seconds_as_ns(bad)) << bad;
}

TEST(ParseNumber, TakesTheWholeTextOrNothing) {
  EXPECT_EQ(parse_number(" +1.5e3 "), 1500.0);
  for (const char* bad : {"", "1.5x", "inf", "nan", "1,5", "--1"}) EXPECT_FALSE(parse_number(bad)) << bad;
}

TEST(ParseBytes, CountsInPowersOf1024) {
  EXPECT_EQ(parse_bytes("256MiB").value(), 256ull << 20);
  EXPECT_EQ(parse_bytes("1.5 GB").value(), 3ull << 29);
  EXPECT_EQ(parse_bytes("4096").value(), 4096u);
  for (const char* bad : {"", "MiB", "-1M", "5 apples", "1e30"}) EXPECT_FALSE(parse_bytes(bad)) << bad;
}

TEST(Split, KeepsEmptyFields) {
  EXPECT_EQ(split("a, b,,c", ','), (std::vector<std::string_view>{"a", "b", "", "c"}));
  EXPECT_EQ(split("", ','), (std::vector<std::string_view>{""}));
}

}  // namespace
}  // namespace nadir
