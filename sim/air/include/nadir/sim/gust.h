#pragma once

#include <Eigen/Core>
#include <string_view>

#include "nadir/base/result.h"

namespace nadir::sim {

/// A discrete gust that a vehicle flies into: its speed follows 1 - cos of the distance flown through the air.
/// Source: MIL-F-8785C, 1980, section 3.7 (step); CS-25, 25.341(a) (pulse).
struct Gust {
  enum class Shape {
    Pulse,  // back to none after two gradient lengths
    Step,   // stays
  };
  /// Where its air goes, seen along the vehicle's way through the air, level.
  enum class Towards { Forward, Back, Right, Left, Up, Down };

  double start_s = 0;
  double speed_mps = 0;   // at its greatest
  double gradient_m = 0;  // from none to the greatest; > 0
  Shape shape = Shape::Pulse;
  Towards towards = Towards::Up;

  /// Speed, where the vehicle is so far into it through the air; 0 before.
  double speed_at_mps(double into_m) const;
  /// Forward, right, down; of unit length.
  Eigen::Vector3d direction() const;
};

std::string_view to_string(Gust::Shape shape);      // "pulse"
std::string_view to_string(Gust::Towards towards);  // "up"
Result<Gust::Shape> parse_gust_shape(std::string_view name);
Result<Gust::Towards> parse_gust_towards(std::string_view name);

}  // namespace nadir::sim
