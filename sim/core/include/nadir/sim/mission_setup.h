#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "nadir/base/yaml.h"
#include "nadir/geodesy/height.h"

namespace nadir::sim {

/// A place of a run file: metres from the scene origin, or latitude and longitude.
struct PlaceSetup {
  struct Geodetic {
    double lat_deg = 0, lon_deg = 0;
  };
  double north_m = 0, east_m = 0;
  std::optional<Geodetic> geodetic;  // then in place of both
};

struct WaypointSetup {
  PlaceSetup place;
  geodesy::TypedHeight height;
  std::optional<double> course_deg, turn_radius_m, airspeed_mps;  // of fixed wings
  std::optional<double> hold_s, yaw_deg, speed_mps;               // of multirotors
};

struct OrbitSetup {
  PlaceSetup center;
  geodesy::TypedHeight height;
  double radius_m = 0;
  bool clockwise = true;
  std::optional<double> turns, duration_s, airspeed_mps;
};

struct RectangleSetup {
  PlaceSetup center;
  double length_m = 0, width_m = 0, heading_deg = 0;
};
struct DiscSetup {
  PlaceSetup center;
  double radius_m = 0;
};
using AreaSetup = std::variant<std::vector<PlaceSetup>, RectangleSetup, DiscSetup>;

/// Lines over an area, flown to and fro. Its sensor takes as many frames as the forward overlap asks for where that
/// one's `rate_hz` is `survey`.
struct SurveySetup {
  AreaSetup area;
  geodesy::TypedHeight height;
  std::string sensor;
  double forward_overlap = 0.6, side_overlap = 0.3;
  std::optional<double> heading_deg;       // else the one with the fewest turns
  double lead_in_m = 100, lead_out_m = 0;  // of multirotors: where they get up to speed, and slow down
  std::optional<double> airspeed_mps;      // of fixed wings
  std::optional<double> speed_mps;         // over ground, of multirotors
};

/// A smooth path by chance, by the run's seed.
struct RandomPathSetup {
  AreaSetup area;
  std::pair<geodesy::TypedHeight, geodesy::TypedHeight> heights;
  std::pair<double, double> turn_radius_m;
  std::optional<std::pair<double, double>> airspeed_mps;
  double max_slope = 0.08, margin_m = 20;
  std::optional<double> length_m;  // else as far as the run lasts
};

struct MissionItemSetup {
  std::variant<WaypointSetup, OrbitSetup, SurveySetup, RandomPathSetup> what;
  int line = 0;      // in the run file
  std::string name;  // for messages: "vehicles.plane1.mission[2]"
};

/// Where a place is given; notes faults in `yaml`.
PlaceSetup read_place(const YamlMap& yaml);

/// Items of `mission:` of a vehicle. One without a height keeps that of the one before, the first one that of the
/// start. `sensors`: of the vehicle, for surveys.
std::vector<MissionItemSetup> read_mission(const YamlMap& vehicle, const geodesy::TypedHeight& start,
                                           double turn_radius_m, std::span<const std::string_view> sensors);

/// The same of a multirotor: waypoints and surveys. `speed_mps` and `acceleration_mps2`: of its flight, which the leads
/// of surveys follow from where nothing is said of them.
std::vector<MissionItemSetup> read_multirotor_mission(const YamlMap& vehicle, const geodesy::TypedHeight& start,
                                                      double speed_mps, double acceleration_mps2,
                                                      std::span<const std::string_view> sensors);

std::string place_text(const PlaceSetup& place);  // "north_m: 1, east_m: 2"
std::string height_text(const geodesy::TypedHeight& height);
/// One flow map, as `read_mission` takes it back.
std::string mission_item_text(const MissionItemSetup& item);

}  // namespace nadir::sim
