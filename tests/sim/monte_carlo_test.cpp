#include "nadir/sim/monte_carlo.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sim/flown_run.h"

namespace nadir::sim {
namespace {

class ManyFlights : public FlownRun {
 protected:
  ManyFlights() { air = "seed: 40\nair: {wind: {from_deg: 146, speed_mps: 3.6}, turbulence: {intensity: moderate}}\n"; }
  RunFile file(const std::string& vehicles, const std::string& more = "") {
    return prepare(vehicles, "4", more).value().file();
  }
};

TEST_F(ManyFlights, AreTheSameInAnyOrderAndThoseOfTheirSeeds) {
  RunFile run = file(plane("a", sensor("cam", "5")) + plane("b", "", "height: 700 agl, yaw_deg: 200"));
  int told = 0;
  const auto one = fly_many(run, 5, 1, [&](int more) { told += more; }).value();
  const auto two = fly_many(run, 5, 2).value();
  EXPECT_EQ(told, 5);
  ASSERT_EQ(one.size(), 10u);
  ASSERT_EQ(two.size(), 10u);
  for (std::size_t i = 0; i < 10; ++i) {
    EXPECT_EQ(one[i].seed, 40 + i / 2);
    EXPECT_EQ(one[i].vehicle, i % 2 ? "b" : "a");
    EXPECT_EQ(one[i].end_s, 4);
    EXPECT_EQ(one[i].track_en_m, two[i].track_en_m);
    EXPECT_EQ(one[i].end_up_m, two[i].end_up_m);
    EXPECT_EQ(one[i].worst_off_path_m, two[i].worst_off_path_m);
    if (i >= 2) {
      EXPECT_NE(one[i].end_east_m, one[i - 2].end_east_m) << "another seed is another flight";
    }
  }
  // As the run itself flies with that seed
  run.seed = 43;
  auto alone = Run::prepare(run).value();
  Recorder recorder;
  render::Renderer renderer({.threads = 1});
  const std::array<Sink*, 1> sinks = {&recorder};
  ASSERT_TRUE(alone.execute(renderer, sinks, false, 0));
  const auto& end = recorder.states.at("b").back();
  const Eigen::Vector3d enu =
      (alone.ground().frame().enu_from_ecef() * geodesy::Point<geodesy::frame::Ecef>{end.ecef_from_body.origin}).xyz;
  EXPECT_EQ(one[7].end_east_m, enu.x());
  EXPECT_EQ(one[7].end_up_m, enu.z());
}

TEST_F(ManyFlights, WhatCannotBeginIsAFailure) {
  RunFile run = file(plane("a", ""));
  run.vehicles[0].second.airspeed_mps = 60;
  const auto none = fly_many(run, 3, 1);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("vehicle a"), std::string::npos);
}

}  // namespace
}  // namespace nadir::sim
