#include "nadir/sim/gust.h"

#include <array>
#include <cmath>
#include <numbers>

#include "nadir/base/text.h"

namespace nadir::sim {
namespace {
constexpr std::array<std::string_view, 2> shape_names = {"pulse", "step"};
constexpr std::array<std::string_view, 6> towards_names = {"forward", "back", "right", "left", "up", "down"};
}  // namespace

double Gust::speed_at_mps(double into_m) const {
  if (into_m <= 0) return 0;
  if (into_m >= gradient_m && shape == Shape::Step) return speed_mps;
  if (into_m >= 2 * gradient_m) return 0;
  return speed_mps / 2 * (1 - std::cos(std::numbers::pi * into_m / gradient_m));
}

Eigen::Vector3d Gust::direction() const {
  switch (towards) {
    case Towards::Forward:
      return {1, 0, 0};
    case Towards::Back:
      return {-1, 0, 0};
    case Towards::Right:
      return {0, 1, 0};
    case Towards::Left:
      return {0, -1, 0};
    case Towards::Up:
      return {0, 0, -1};
    case Towards::Down:
      break;
  }
  return {0, 0, 1};
}

std::string_view to_string(Gust::Shape shape) { return shape_names[static_cast<std::size_t>(shape)]; }
std::string_view to_string(Gust::Towards towards) { return towards_names[static_cast<std::size_t>(towards)]; }
Result<Gust::Shape> parse_gust_shape(std::string_view name) {
  return parse_name<Gust::Shape>("shape of a gust", name, shape_names);
}
Result<Gust::Towards> parse_gust_towards(std::string_view name) {
  return parse_name<Gust::Towards>("direction of a gust", name, towards_names);
}

}  // namespace nadir::sim
