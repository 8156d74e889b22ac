// What a run's missions come to, and what is said of them before they are flown.
#include "nadir/sim/preflight.h"

#include "flown_run.h"
#include "nadir/sim/area.h"

namespace nadir::sim {
namespace {

class Missions : public FlownRun {
 protected:
  Missions() { air.clear(); }
  /// A vehicle with the small camera, 120 x 90 pixels: 1.2 m across and 0.9 m along for each metre of height.
  static std::string vehicle(const std::string& mission, const std::string& rate = "1", const std::string& more = "") {
    return fmt::format(
        "  p:\n    start: {{north_m: -800, east_m: 0, height: 300 agl, yaw_deg: 0}}\n{}    mission:\n{}    "
        "sensors:\n{}",
        more, mission, sensor("cam", rate));
  }
  std::vector<PreflightFinding> findings(const sim::Run& run) const {
    const auto found = preflight(run);
    EXPECT_TRUE(found) << (found ? "" : found.error().message);
    return found ? *found : std::vector<PreflightFinding>();
  }
  std::string said(const std::string& vehicles, const std::string& duration_s = "60") {
    const auto run = prepare(vehicles, duration_s);
    std::string text = run ? "" : run.error().message;
    if (run)
      for (const PreflightFinding& f : findings(*run)) text += (f.impossible ? "E " : "W ") + f.message + "\n";
    const std::string path = folder.path().string() + "/";
    for (auto at = text.find(path); at != std::string::npos; at = text.find(path)) text.erase(at, path.size());
    return text;
  }
};

TEST_F(Missions, GeodeticAndLocalPlacesAreTheSame) {
  const auto run = prepare(vehicle("      - {north_m: 300, east_m: 400}\n"), "10");
  ASSERT_TRUE(run) << run.error().message;
  const geodesy::LocalFrame& frame = run->ground().frame();
  const geodesy::Geodetic place =
      geodesy::geodetic_from_ecef(frame.ecef_from_enu() * geodesy::Point<geodesy::frame::Enu>{{400, 300, 300}});
  const auto same =
      prepare(vehicle(fmt::format("      - {{lat_deg: {}, lon_deg: {}}}\n", geodesy::to_degrees(place.lat_rad),
                                  geodesy::to_degrees(place.lon_rad))),
              "10");
  ASSERT_TRUE(same) << same.error().message;
  const auto end = [](const sim::Run& r) { return r.vehicles()[0].plan->mission.pieces()[0].end; };
  EXPECT_NEAR((end(*run) - end(*same)).norm(), 0, 1e-3) << "degrees are of the surface's normal: 0.1 mm at 300 m";
}

TEST_F(Missions, OverTheCurvedEarthHeightsHoldAtTheirPlace) {
  const auto height_at_20_km = [&](const std::string& surface) {
    const auto file = read_run_file(folder.write(
        "run.yaml", fmt::format("duration_s: 1\nscene:\n  ground: 20\n  surface: {}\n  layers:\n    eo: {{map: m.tif, "
                                "bands: [1]}}\nvehicles:\n{}",
                                surface, vehicle("      - {north_m: 20000, east_m: 0, height: 300 agl}\n"))));
    const auto run = sim::Run::prepare(file.value());
    return std::get<StraightPath>(run->vehicles()[0].plan->mission.pieces()[0].path).to_height_m;
  };
  // The Earth falls away from the tangent plane by d^2 / 2R, R = 6.36e6 m along this meridian
  EXPECT_NEAR(height_at_20_km("plane") - height_at_20_km("ellipsoid"), 20000.0 * 20000 / (2 * 6.36e6), 0.1);
}

TEST_F(Missions, AllFaultsOfAllVehiclesAreToldWithTheirLines) {
  const std::string q = "  q:\n    start: {height: -5 agl}\n    mission:\n      - {north_m: 500, east_m: 0}\n";
  const std::string text = said(
      vehicle("      - orbit: {north_m: 0, east_m: 0, radius_m: 100}\n      - {north_m: 300, east_m: 900}\n"
              "      - survey: {polygon: [{north_m: 0, east_m: 0}, {north_m: 9, east_m: 9}, {north_m: 9, east_m: 0}, "
              "{north_m: 0, east_m: 9}], sensor: cam}\n"
              "      - random: {circle: {radius_m: 100}}\n") +
      q);
  for (const char* part : {"'vehicles.p.mission[0]': goes on for ever",
                           "'vehicles.p.mission[2]': the edges from corner 1 and from corner 3",
                           "'vehicles.p.mission[3]': turns of 150 m and a margin of 20 m need a place 340 m wide",
                           "'vehicles.q': start: expected a height on the ground or above it, found -5.0 m over it"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\nin\n" << text;
  EXPECT_EQ(text.find("run.yaml:"), 0u) << text;
  EXPECT_NE(said(vehicle("      - {north_m: 300, east_m: 400}\n      - {north_m: 300, east_m: 400.2}\n"))
                .find("run.yaml:11: 'vehicles.p.mission[1]': is less than 1 m from what comes before it"),
            std::string::npos);
}

TEST_F(Missions, WhatCannotBeFlownAndWhatIsDoubtfulAreTold) {
  EXPECT_EQ(said(vehicle("      - {north_m: 800, east_m: 0}\n")), "");
  const auto has = [&](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << part << "\nin\n" << text;
  };
  has(said(vehicle("      - {north_m: 100, east_m: 0, height: 500 agl}\n")),
      "E run.yaml:10: 'vehicles.p.mission[0]': asks for a climb of 5.6 m/s");
  has(said(vehicle("      - {north_m: 2000, east_m: 0, height: 10 agl}\n")),
      "W run.yaml:10: 'vehicles.p.mission[0]': "
      "comes within 10.0 m of the ground");
  has(said(vehicle("      - {north_m: 4000, east_m: 0, height: -10 agl}\n")), "leads 10.0 m under the ground");
  has(said(vehicle("      - orbit: {north_m: 0, east_m: 0, radius_m: 50}\n")),
      "E run.yaml:10: 'vehicles.p.mission[0]': "
      "a turn of 50 m at 25.0 m/s");
  has(said(vehicle("      - {north_m: 800, east_m: 0, airspeed_mps: 90}\n")),
      "E run.yaml:10: 'vehicles.p.mission[0]': ");
  has(said(vehicle("      - {north_m: 9000, east_m: 0}\n"), "500"),
      "W run.yaml:10: 'vehicles.p.mission[0]': cam leaves "
      "the map in about");
  air = "air: {wind: {from_deg: 0, speed_mps: 26}}\n";
  has(said(vehicle("      - {north_m: 800, east_m: 0}\n")), "leave no headway along the course of");
  has(said("  p:\n    start: {height: 300 agl}\n"), "'vehicles.p': a wind of 26.0 m/s");
  air = "air: {gusts: [{start_s: 1, speed_mps: 20, gradient_m: 30, towards: up}]}\n";
  has(said(vehicle("      - {north_m: 800, east_m: 0}\n")),
      "W run.yaml:11: 'vehicles.p.mission[0]': gusts of 20.0 m/s");
}

const std::string survey_item =
    "      - survey: {rectangle: {length_m: 700, width_m: 500, heading_deg: 30}, sensor: cam, forward_overlap: 0.6}\n";

TEST_F(Missions, ASensorTakesTheRateThatItsSurveyAsksFor) {
  const auto run = prepare(vehicle(survey_item, "survey"), "210");
  ASSERT_TRUE(run) << run.error().message;
  const PlannedSurvey& survey = run->vehicles()[0].plan->surveys.at(0);
  // From 300 m the camera sees 270 m along straight down, a little more with the nose up, less 6 m at each end; 0.4 of
  // that between exposures, in still air at 25 m/s, and a hundredth more
  EXPECT_GT(survey.exposure_spacing_m, 0.4 * 258);
  EXPECT_LT(survey.exposure_spacing_m, 0.4 * 264);
  EXPECT_NEAR(survey.rate_hz, 1.01 * 25 / survey.exposure_spacing_m, 1e-9);
  const SensorSetup& sensor = run->file().vehicles[0].second.sensors[0].second;
  EXPECT_EQ(sensor.rate_text, fmt::format("{:.3f}", std::ceil(1000 * survey.rate_hz) / 1000));
  EXPECT_EQ(run->sensor("p", "cam").setup.rate.samples, sensor.rate.samples);
  EXPECT_EQ(preflight_text(findings(*run), false) + preflight_text(findings(*run), true), "");
  EXPECT_NE(to_yaml(run->file()).find("rate_hz: " + sensor.rate_text), std::string::npos)
      << "a replay needs no survey for it";
  const std::string slow = said(vehicle(survey_item, "0.1"), "40");
  EXPECT_NE(slow.find("frames a second, and cam makes 0.1"), std::string::npos) << slow;
  EXPECT_NE(slow.find("the run ends after 40 s"), std::string::npos) << slow;
}

TEST_F(Missions, AFlownSurveySeesEachPointAsOftenAsItPromises) {
  air = "air: {wind: {from_deg: 200, speed_mps: 5}}\n";
  const Recorder flight = execute(vehicle(survey_item, "survey"), "240", /*frames=*/false);
  const auto run = prepare(vehicle(survey_item, "survey"), "240");
  EXPECT_EQ(run->vehicles()[0].plan->surveys[0].seen_at_least, 2);
  // Footprints of exposures flown with little bank, counted over a grid of the area in longitude and latitude
  const Area area = Area::rectangle({0, 0}, 700, 500, geodesy::to_radians(30));
  int fewest = 1000;
  for (double n = -420; n <= 420; n += 20)
    for (double e = -420; e <= 420; e += 20) {
      if (!area.contains({n, e})) continue;
      const geodesy::Geodetic place = geodesy::geodetic_from_ecef(run->ground().frame().ecef_from_enu() *
                                                                  geodesy::Point<geodesy::frame::Enu>{{e, n, 0}});
      int seen = 0;
      for (const auto& exposure : flight.exposures.at("p/cam")) {
        bool inside = false;
        const auto& outline = exposure.truth.footprint.outline_lon_lat_rad;
        for (std::size_t i = 0; i < outline.size(); ++i) {
          const auto &a = outline[i], &b = outline[(i + 1) % outline.size()];
          if ((a.y() > place.lat_rad) != (b.y() > place.lat_rad) &&
              place.lon_rad < a.x() + (place.lat_rad - a.y()) / (b.y() - a.y()) * (b.x() - a.x()))
            inside = !inside;
        }
        seen += inside;
      }
      fewest = std::min(fewest, seen);
    }
  EXPECT_GE(fewest, 2);
  EXPECT_LE(fewest, 4) << "the promise is not kept by flying too much";
}

TEST_F(Missions, ARandomPathFollowsFromSeedAndName) {
  const std::string random =
      "      - random: {circle: {radius_m: 900}, heights: [250 agl, 330 agl], turn_radius_m: [120, 250]}\n";
  const auto path = [&](const std::string& seed, const std::string& name) {
    std::string text = vehicle(random);
    text.replace(2, 1, name);
    const auto run = prepare(text, "120", "seed: " + seed + "\n");
    EXPECT_TRUE(run) << (run ? "" : run.error().message);
    std::vector<double> places;
    for (const PlannedPoint& p : planned_points(run->vehicles()[0].plan->mission, 20)) {
      places.push_back(p.north_m), places.push_back(p.height_m);
      EXPECT_LE(std::hypot(p.north_m, p.east_m), 900 - 20);
      EXPECT_GE(p.height_m, 250);
      EXPECT_LE(p.height_m, 330);
    }
    EXPECT_TRUE(findings(*run).empty()) << findings(*run)[0].message;
    return places;
  };
  EXPECT_EQ(path("1", "p"), path("1", "p"));
  EXPECT_NE(path("1", "p"), path("2", "p"));
  EXPECT_NE(path("1", "p"), path("1", "q"));
}

TEST_F(Missions, AMissionOfEverythingIsFlownNearItsPath) {
  const std::string mission =
      "      - {north_m: 200, east_m: 0, course_deg: 60, airspeed_mps: 22}\n"
      "      - orbit: {north_m: 500, east_m: 500, height: 320 agl, radius_m: 150, turns: 1, direction: left}\n"
      "      - {north_m: -300, east_m: 600, turn_radius_m: 200, airspeed_mps: 28}\n"
      "      - {north_m: -300, east_m: -300, height: 300 agl}\n"
      "      - orbit: {north_m: 0, east_m: -500, radius_m: 200}\n";
  const Recorder flight = execute(vehicle(mission), "220", /*frames=*/false);
  double across = 0, height = 0, slowest = 100, fastest = 0;
  for (const VehicleState& s : flight.states.at("p")) {
    if (s.time_ns < 5'000'000'000) continue;
    across = std::max(across, std::abs(s.flight->off_path_right_m));
    height = std::max(height, std::abs(s.flight->off_path_above_m));
    slowest = std::min(slowest, s.flight->airspeed_mps), fastest = std::max(fastest, s.flight->airspeed_mps);
  }
  RecordProperty("across_m", std::to_string(across));
  RecordProperty("height_m", std::to_string(height));
  EXPECT_LT(across, 1);
  EXPECT_LT(height, 0.5);
  EXPECT_NEAR(slowest, 22, 0.6);
  EXPECT_NEAR(fastest, 28, 0.6);
}

}  // namespace
}  // namespace nadir::sim
