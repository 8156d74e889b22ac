#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <map>
#include <string>
#include <vector>

#include "nadir/sim/run.h"
#include "support/scene.h"
#include "support/temporary_folder.h"

namespace nadir::sim {

/// Keeps what a run tells; counters, truth and samples of frames.
struct Recorder final : Sink {
  struct Exposure {
    VehicleState state;
    render::CameraPose ecef_from_camera;
    render::FrameCounters counters;
    render::Truth truth;
    render::FrameBuffer<std::byte> samples;
    std::string rejected;
  };
  std::map<std::string, std::vector<VehicleState>> states;
  std::map<std::string, std::vector<Exposure>> exposures;  // by vehicle/sensor
  int finished = 0;
  std::int64_t fail_at_ns = INT64_MAX;

  Result<void> on_state(const std::string& vehicle, const VehicleState& state) override {
    states[vehicle].push_back(state);
    if (state.time_ns >= fail_at_ns) return fail(Error::Kind::Io, "the disk is full");
    return {};
  }
  Result<void> on_frame(const FrameEvent& event) override {
    Exposure exposure{event.state, event.truth.ecef_from_camera, {}, event.truth, {}, event.rejected};
    if (event.frame) {
      exposure.counters = event.frame->counters();
      exposure.samples = event.frame->layer(event.sensor).samples;
    }
    exposures[event.vehicle + "/" + event.sensor].push_back(std::move(exposure));
    return {};
  }
  Result<void> finish() override {
    ++finished;
    return {};
  }
};

inline bool same(const VehicleState& a, const VehicleState& b) {
  return a.time_ns == b.time_ns && a.ecef_from_body.origin == b.ecef_from_body.origin &&
         a.ecef_from_body.rotation.coeffs() == b.ecef_from_body.rotation.coeffs() &&
         a.flight.has_value() == b.flight.has_value() &&
         (!a.flight ||
          (a.flight->velocity_ned_mps == b.flight->velocity_ned_mps && a.flight->throttle == b.flight->throttle &&
           a.flight->off_path_right_m == b.flight->off_path_right_m));
}

class FlownRun : public testing::Test {
 protected:
  FlownRun() {
    test::SyntheticMap map;  // 0.05 degrees of longitude and latitude, 5 bands
    map.width = map.height = 1024;
    map.bands = 5;
    map.type = GDT_Byte;
    map.geotransform = {-0.78, 5e-5, 0, 38.13, 0, -5e-5};
    map.value = [](int, int band, int col, int row) { return (band * 40 + col + 3 * row) % 251; };
    test::write_map(map, folder.file("m.tif"));
    folder.write("c.yaml",
                 "image_width: 120\nimage_height: 90\ncamera_matrix: {rows: 3, cols: 3, data: [100, 0, 59.5, 0, 100, "
                 "44.5, 0, 0, 1]}\n");
  }

  static std::string plane(const std::string& name, const std::string& sensors,
                           const std::string& start = "height: 500 agl, yaw_deg: 30") {
    return fmt::format(
        "  {}:\n    start: {{{}}}\n    mission: [{{north_m: 60, east_m: 120}}, {{north_m: -400, east_m: 100}}]\n{}",
        name, start, sensors.empty() ? "" : "    sensors:\n" + sensors);
  }
  static std::string sensor(const std::string& name, const std::string& rate_hz, const std::string& more = "") {
    return fmt::format("      {}: {{layer: eo, camera: c.yaml, rate_hz: {}{}}}\n", name, rate_hz, more);
  }
  Result<sim::Run> prepare(const std::string& vehicles, const std::string& duration_s, const std::string& more = "") {
    const auto file = read_run_file(folder.write(
        "run.yaml", fmt::format("duration_s: {}\nscene:\n  ground: 20\n  layers:\n    eo: {{map: m.tif, bands: [4, "
                                "2]}}\n{}{}vehicles:\n{}",
                                duration_s, air, more, vehicles)));
    if (!file) return fail(file);
    return sim::Run::prepare(*file);
  }
  Recorder execute(const std::string& vehicles, const std::string& duration_s, bool frames,
                   const std::string& more = "") {
    Recorder recorder;
    auto run = prepare(vehicles, duration_s, more);
    EXPECT_TRUE(run) << (run ? "" : run.error().message);
    if (!run) return recorder;
    render::Renderer renderer({.threads = 1});
    const std::array<Sink*, 1> sinks = {&recorder};
    const auto done = run->execute(renderer, sinks, frames, 0);
    EXPECT_TRUE(done) << (done ? "" : done.error().message);
    return recorder;
  }
  test::TemporaryFolder folder;
  std::string air = "air: {wind: {from_deg: 146, speed_mps: 3.6}}\n";
};

}  // namespace nadir::sim
