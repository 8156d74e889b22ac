// Surveys as they are flown: how far from its lines a vehicle is.
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <set>

#include <gtest/gtest.h>

#include "closed_loop.h"
#include "nadir/sim/survey.h"

namespace nadir::sim {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;
constexpr double height_m = 1000;

/// Lines 60 m apart, far less than two radii.
SurveyOrder close_lines(double radius_m) {
  SurveyOrder order;
  order.seen_m = {Vector2d(-50, -60), Vector2d(50, 60)};
  order.side_overlap = 0.5;
  order.height_m = height_m;
  order.lead_in_m = 100;
  order.turn_radius_m = radius_m;
  order.heading_rad = 0.5;
  return order;
}
const Area field = Area::rectangle({1000, 500}, 700, 900, 0.5);

Mission mission_of(const SurveyPlan& plan, double radius_m) {
  const std::vector<MissionItem> items(plan.waypoints.begin(), plan.waypoints.end());
  return Mission::create({0, 0, height_m, 0.0}, items, radius_m).value();
}

/// Where exposures may fall: the farthest off the line, and off its course.
struct OffLines {
  double right_m = 0, course_deg = 0, above_m = 0;
  std::set<std::size_t> lines;
};

OffLines flown(const SurveyPlan& plan, double lead_in_m, double radius_m, const Vector3d& wind_ned) {
  Mission mission = mission_of(plan, radius_m);
  ClosedLoop loop(Environment::wgs84(), height_m, wind_ned);
  OffLines off;
  double time_s = 0;
  while (!mission.finished() && time_s < 3600) {
    loop.fly(
        1, [&](const Navigation& now) { return follow(mission.piece_at(now, time_s).path, now, loop.gains.path); },
        [&](const Navigation& now) {
          const MissionPiece& piece = mission.piece_at(now, time_s);
          const auto* of_line = std::get_if<StraightPath>(&piece.path);
          if (piece.item % 2 == 0 || !of_line) return;  // on the way to a line, or after the last
          const StraightPath& line = *of_line;
          const Vector2d along = (line.to - line.from).normalized();
          const double past_m = (Vector2d(now.north_m, now.east_m) - line.from).dot(along);
          if (past_m < lead_in_m) return;
          const PathError error = path_error(piece.path, now);
          off.lines.insert(piece.item / 2);
          off.right_m = std::max(off.right_m, std::abs(error.right_m));
          off.above_m = std::max(off.above_m, std::abs(error.above_m));
          off.course_deg =
              std::max(off.course_deg, std::abs(geodesy::to_degrees(std::remainder(
                                           now.course_rad - std::atan2(along.y(), along.x()), 2 * std::numbers::pi))));
        });
    time_s += 1;
  }
  return off;
}

TEST(SurveyFlight, VehiclesAreOnTheirLinesBeforeTheAreaBegins) {
  constexpr double radius_m = 150;
  const SurveyOrder order = close_lines(radius_m);
  const SurveyPlan plan = plan_survey(field, order).value();
  const OffLines still = flown(plan, order.lead_in_m, radius_m, {0, 0, 0});
  EXPECT_EQ(still.lines.size(), static_cast<std::size_t>(plan.lines));
  EXPECT_LT(still.right_m, 0.5);
  EXPECT_LT(still.course_deg, 1);
  EXPECT_LT(still.above_m, 0.5);

  // 30 % of the airspeed: up to half as much speed over ground again, through the same turns
  const Vector3d wind_ned(7.5, 0, 0);
  const OffLines windy = flown(plan, order.lead_in_m, radius_m, wind_ned);
  EXPECT_LT(windy.right_m, 1.5);
  EXPECT_LT(windy.course_deg, 1.5);

  // Turns that swing out change sides on the line's doorstep
  SurveyOrder one_by_one = order;
  one_by_one.turn_radius_m = 0;
  const OffLines swings = flown(plan_survey(field, one_by_one).value(), order.lead_in_m, radius_m, wind_ned);
  EXPECT_GT(swings.right_m, 1.5 * windy.right_m);
  for (const auto& [name, off] : {std::pair("still", still), {"windy", windy}, {"one_by_one_windy", swings}})
    RecordProperty(
        name, fmt::format("{:.2f} m aside, {:.2f} deg, {:.2f} m of height", off.right_m, off.course_deg, off.above_m));
}

}  // namespace
}  // namespace nadir::sim
