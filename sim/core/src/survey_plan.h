#pragma once

#include <functional>
#include <utility>

#include "nadir/sim/flight_plan.h"
#include "nadir/sim/survey.h"

namespace nadir::sim {

/// How a vehicle flies along a line.
struct LineFlight {
  geodesy::YawPitchRoll course_from_body;  // yaw: of the nose, to the right of the course
  double ground_speed_mps = 0;
};

/// What a survey has to know of the vehicle that flies it.
struct SurveyFlight {
  /// Along a course over a place, in a wind towards north and east; `back`: against the first line.
  std::function<LineFlight(double course_rad, bool back, const Eigen::Vector2d& wind_mps,
                           const geodesy::Point<geodesy::frame::Ecef>& place)>
      along;
  double turn_radius_m = 0;       // 0: turns on the spot
  Eigen::Vector2d from = {0, 0};  // where it comes from
};

Result<Area> area_in_scene(const AreaSetup& setup, const geodesy::TypedHeight& height, const render::Surface& ground);

/// Lines over the survey's area, planned for what its camera sees in flight in the wind of the place, and what it came
/// to (without its item).
Result<std::pair<SurveyPlan, PlannedSurvey>> plan_survey_in_scene(const RunFile& run, const SurveySetup& setup,
                                                                  const render::Surface& ground,
                                                                  std::span<const VehicleCamera> cameras,
                                                                  const SurveyFlight& flight);

}  // namespace nadir::sim
