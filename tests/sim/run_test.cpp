// Whole runs on small maps: what cameras see, when, and that parts of a run do not disturb each other.
#include <gtest/gtest.h>

#include <cmath>

#include "sim/flown_run.h"

namespace nadir::sim {
namespace {

TEST_F(FlownRun, AFrameBetweenTwoStepsOfTheMotionHasThePoseOfItsOwnTime) {
  // 1100 Hz against periods of 10 ms: exposures at every part of one. The motion is smooth, so a pose lies between its
  // neighbours to within a h^2 / 2 on unlike intervals h <= 0.91 ms; the aircraft's acceleration a stays below 2 g:
  // 8e-6 m. Rounding of ECEF: 1e-9 m.
  const auto exposures = execute(plane("p", sensor("cam", "1100")), "2", false).exposures.at("p/cam");
  ASSERT_EQ(exposures.size(), 2201u);
  double worst_m = 0;
  for (std::size_t i = 1; i + 1 < exposures.size(); ++i) {
    const VehicleState &a = exposures[i - 1].state, &b = exposures[i].state, &c = exposures[i + 1].state;
    const double s = static_cast<double>(b.time_ns - a.time_ns) / static_cast<double>(c.time_ns - a.time_ns);
    worst_m = std::max(worst_m, (a.ecef_from_body.origin + s * (c.ecef_from_body.origin - a.ecef_from_body.origin) -
                                 b.ecef_from_body.origin)
                                    .norm());
    ASSERT_GT((c.ecef_from_body.origin - b.ecef_from_body.origin).norm(), 0.015)
        << "at more than 20 m/s; at " << c.time_ns << " ns";
  }
  EXPECT_LE(worst_m, 8e-6);
  EXPECT_GT(worst_m, 1e-8) << "it turns and climbs";
}

TEST_F(FlownRun, HowOftenItIsLookedAtDoesNotChangeTheFlight) {
  const auto coarse = execute(plane("p", sensor("cam", "30")), "3", false, "record: {telemetry_rate_hz: 7}\n");
  const auto fine = execute(plane("p", sensor("cam", "300") + sensor("other", "77.7")), "3", false,
                            "record: {telemetry_rate_hz: 400}\n");
  const auto &few = coarse.exposures.at("p/cam"), &many = fine.exposures.at("p/cam");
  ASSERT_EQ(few.size(), 91u);
  int between_steps = 0;
  for (std::size_t i = 0; i < few.size(); ++i) {
    EXPECT_TRUE(same(few[i].state, many[10 * i].state)) << "the same bits at " << few[i].state.time_ns << " ns";
    between_steps += few[i].state.time_ns % 2'500'000 != 0;
  }
  EXPECT_GT(between_steps, 50) << "these times no longer fall between steps";
}

TEST_F(FlownRun, HowMotionIsSteppedIsChosenOnceAndAReplayTakesIt) {
  const auto run = prepare(plane("p", ""), "3");
  ASSERT_TRUE(run);
  const auto& chosen = run->file().vehicles[0].second.integration;
  ASSERT_TRUE(chosen);
  EXPECT_EQ(*chosen, run->vehicles()[0].source->motion_plan()->scheme);
  EXPECT_NE(run->vehicles()[0].source->motion_plan()->why.find("evaluations"), std::string::npos);
  const auto again = sim::Run::prepare(read_run_file(folder.write("again.yaml", to_yaml(run->file()))).value());
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->file().vehicles[0].second.integration, chosen);
  EXPECT_NE(again->vehicles()[0].source->motion_plan()->why.find("run file"), std::string::npos);
}

TEST_F(FlownRun, ACamerasPoseIsItsVehiclesWithTheMount) {
  const auto exposures =
      execute(plane("p", sensor("cam", "3", ", mount: {x_m: 2, pitch_deg: 10}")), "1", false).exposures.at("p/cam");
  for (const auto& e : exposures) {
    const auto expected =
        e.state.ecef_from_body * render::body_from_camera({{2, 0, 0}, geodesy::YawPitchRoll::degrees(0, 10, 0)});
    EXPECT_EQ(e.ecef_from_camera.origin, expected.origin);
    EXPECT_NEAR((e.ecef_from_camera.origin - e.state.ecef_from_body.origin).norm(), 2, 1e-8);
  }
}

TEST_F(FlownRun, VehiclesOfOneRunDoNotDisturbEachOther) {
  const std::string one = plane("one", sensor("cam", "7")),
                    two = plane("two", sensor("cam", "5"),
                                "height: 400 agl, yaw_deg: -80, airspeed_mps: 30, north_m: 100");
  const Recorder both = execute(one + two, "2", true), alone1 = execute(one, "2", true),
                 alone2 = execute(two, "2", true);
  for (const auto& [name, alone] : {std::pair<std::string, const Recorder&>("one", alone1), {"two", alone2}}) {
    const auto &together = both.states.at(name), &single = alone.states.at(name);
    ASSERT_EQ(together.size(), 101u);
    ASSERT_EQ(together.size(), single.size());
    for (std::size_t i = 0; i < single.size(); ++i)
      EXPECT_TRUE(same(together[i], single[i])) << name << " at " << single[i].time_ns << " ns";
    const auto &frames = both.exposures.at(name + "/cam"), &single_frames = alone.exposures.at(name + "/cam");
    ASSERT_EQ(frames.size(), single_frames.size());
    for (std::size_t i = 0; i < frames.size(); ++i)
      EXPECT_EQ(frames[i].samples, single_frames[i].samples) << name << ", frame " << i;
  }
  EXPECT_FALSE(same(both.states.at("one").back(), both.states.at("two").back())) << "they fly differently";
}

TEST_F(FlownRun, AFlatPinholeRunOverLongitudeAndLatitudeDoesNothingThatItsSceneDoesNotNeed) {
  const auto exposures =
      execute("  p:\n    start: {height: 500 agl, yaw_deg: 30}\n    sensors:\n" + sensor("cam", "10"), "2", true)
          .exposures.at("p/cam");
  ASSERT_EQ(exposures.size(), 21u);
  std::int64_t loaded = 0;
  for (const auto& e : exposures) {
    EXPECT_EQ(e.counters.projection_points, 0) << "longitude and latitude need no projection library";
    EXPECT_LT(e.counters.exact_points, 120 * 90 / 10)
        << "the chain is evaluated where the mapping is planned, not at the 10800 pixels";
    EXPECT_EQ(e.counters.samples_read, e.counters.cells_loaded * tile::cell_size * tile::cell_size * 2)
        << "two bands of five";
    EXPECT_FALSE(e.samples.empty());
    loaded += e.counters.cells_loaded;
  }
  EXPECT_GT(exposures.front().counters.windows_read, 0);
  EXPECT_LE(loaded, 64) << "an 8 by 8 map of cells, each read at most once";
  int warm = 0;
  for (const auto& e : exposures) warm += e.counters.windows_read == 0 && e.counters.samples_read == 0;
  EXPECT_GE(warm, 15) << "after 50 m straight on, a footprint of 600 m lies on cells that were read before";
}

TEST_F(FlownRun, FramesTakeNoPartInTheFlight) {
  const Recorder with = execute(plane("p", sensor("cam", "10")), "1", true),
                 without = execute(plane("p", sensor("cam", "10")), "1", false);
  ASSERT_EQ(with.states.at("p").size(), without.states.at("p").size());
  for (std::size_t i = 0; i < with.states.at("p").size(); ++i)
    EXPECT_TRUE(same(with.states.at("p")[i], without.states.at("p")[i]));
  for (const auto& e : without.exposures.at("p/cam")) EXPECT_TRUE(e.samples.empty()) << "a rehearsal renders nothing";
  EXPECT_EQ(with.exposures.at("p/cam")[3].ecef_from_camera.origin,
            without.exposures.at("p/cam")[3].ecef_from_camera.origin)
      << "but it says where the camera would look";
}

TEST_F(FlownRun, AFailureIsToldAndLeavesSinksFinished) {
  auto run = prepare(plane("p", ""), "2").value();
  Recorder good, bad;
  bad.fail_at_ns = 1'000'000'000;
  render::Renderer renderer;
  const std::array<Sink*, 2> sinks = {&good, &bad};
  const auto done = run.execute(renderer, sinks, false, 0);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().message, "the disk is full");
  EXPECT_EQ(good.states.at("p").back().time_ns, 1'000'000'000) << "nothing came after it";
  EXPECT_EQ(good.finished + bad.finished, 2) << "a file half told is still closed";
}

TEST_F(FlownRun, OffTheMapAFrameIsRejectedOrMaskedAsItsSensorSays) {
  const std::string start = "height: 500 agl, yaw_deg: 30, north_m: 20000";  // the map ends at 2.8 km
  const auto exposures =
      execute(plane("p", sensor("strict", "2", ", off_map: reject") + sensor("mild", "2"), start), "1", true).exposures;
  for (const auto& e : exposures.at("p/strict")) {
    EXPECT_NE(e.rejected, "");
    EXPECT_TRUE(e.samples.empty());
  }
  for (const auto& e : exposures.at("p/mild")) {
    EXPECT_EQ(e.rejected, "");
    EXPECT_EQ(e.samples.size(), 120u * 90 * 2);
  }
}

TEST_F(FlownRun, WhatCannotFlyIsSaidBeforeTheFirstStep) {
  const auto said = [&](const std::string& vehicles) {
    const auto run = prepare(vehicles, "2");
    return run ? std::string("accepted") : run.error().message;
  };
  EXPECT_NE(said(plane("p", "", "height: 500 agl, airspeed_mps: 60")).find("vehicle p: "), std::string::npos);
  EXPECT_NE(said("  p: {start: {height: 500 agl}, mission: [{north_m: 0, east_m: 0}]}\n")
                .find("'vehicles.p.mission[0]': is less than 1 m"),
            std::string::npos)
      << "a leg of no length";
  EXPECT_NE(said(plane("p", "      cam: {layer: eo, camera: gone.yaml, rate_hz: 1}\n")).find("gone.yaml"),
            std::string::npos);
}

class RecordedRun : public FlownRun {
 protected:
  const std::string header = "t_s,lat_deg,lon_deg,height_m,yaw_deg,pitch_deg,roll_deg\n";
  std::string recorded(const std::string& rows, const std::string& sensors = sensor("cam", "30")) {
    folder.write("poses.csv", header + rows);
    return "  r:\n    model: poses\n    poses: poses.csv\n    sensors:\n" + sensors;
  }
};

TEST_F(RecordedRun, BetweenRowsThePoseMovesStraightAndTurnsEvenly) {
  const auto exposures =
      execute(recorded("0,38.1,-0.76,500,0,0,0\n1,38.1,-0.76,600,30,0,0\n2,38.1,-0.76,600,30,0,8\n"), "2", false)
          .exposures.at("r/cam");
  ASSERT_EQ(exposures.size(), 61u);
  for (const auto& e : exposures) {
    const double t = static_cast<double>(e.state.time_ns) * 1e-9;
    EXPECT_NEAR(e.state.place.height_m, 500 + 100 * std::min(t, 1.0), 1e-6) << t;  // rounding of ECEF and its inverse
    EXPECT_NEAR(geodesy::to_degrees(e.state.attitude.yaw_rad), 30 * std::min(t, 1.0), 1e-6) << t;
    EXPECT_NEAR(geodesy::to_degrees(e.state.attitude.roll_rad), 8 * std::max(t - 1, 0.0), 1e-6) << t;
    EXPECT_FALSE(e.state.flight) << "a recorded vehicle knows its pose only";
  }
}

TEST_F(RecordedRun, ATurnThroughNorthGoesTheShortWay) {
  const auto exposures =
      execute(recorded("0,38.1,-0.76,500,350,0,0\n1,38.1,-0.76,500,10,0,0\n", sensor("cam", "2")), "1", false)
          .exposures.at("r/cam");
  EXPECT_NEAR(std::remainder(geodesy::to_degrees(exposures[1].state.attitude.yaw_rad), 360), 0, 1e-6);
}

TEST_F(RecordedRun, TimesBeyondItsFileAreRefusedBeforeTheFirstStep) {
  const auto said = [&](const std::string& rows, const std::string& duration_s) {
    const auto run = prepare(recorded(rows), duration_s);
    return run ? std::string("accepted") : run.error().message;
  };
  const std::string rows = "0,38.1,-0.76,500,0,0,0\n2,38.1,-0.76,600,0,0,0\n";
  EXPECT_EQ(said(rows, "2"), "accepted") << "its last row is the end";
  EXPECT_NE(said(rows, "2.000000001")
                .find("poses.csv: has poses from 0 s to 2 s, and the run needs them from 0 s to 2.000000001 s"),
            std::string::npos)
      << said(rows, "2.000000001");
  EXPECT_NE(said("0.5,38.1,-0.76,500,0,0,0\n2,38.1,-0.76,600,0,0,0\n", "2").find("has poses from 0.5 s"),
            std::string::npos)
      << "nor before its first row";
}

}  // namespace
}  // namespace nadir::sim
