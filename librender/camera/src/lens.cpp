#include "nadir/render/lens.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "nadir/base/text.h"
#include "polynomial.h"

namespace nadir::render {
namespace {

constexpr std::array<std::string_view, 3> model_names = {"plumb_bob", "rational_polynomial", "equidistant"};
constexpr double infinity = std::numeric_limits<double>::infinity();
/// The square of a tangent of 89.99 degrees: no pinhole looks farther aside.
constexpr double greatest_square = 3.3e7;

using Polynomial = std::vector<double>;

Polynomial operator*(const Polynomial& a, const Polynomial& b) {
  Polynomial product(a.size() + b.size() - 1, 0.0);
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) product[i + j] += a[i] * b[j];
  return product;
}

/// s p'(s)
Polynomial times_slope(Polynomial p) {
  for (std::size_t i = 0; i < p.size(); ++i) p[i] *= static_cast<double>(i);
  return p;
}

}  // namespace

std::string_view to_string(LensModel model) { return model_names[static_cast<std::size_t>(model)]; }
Result<LensModel> parse_lens_model(std::string_view text) {
  return parse_name<LensModel>("distortion model", text, model_names);
}

Result<Lens> Lens::make(LensModel model, std::span<const double> coefficients) {
  constexpr std::array<std::size_t, 3> counts = {5, 8, 4};
  const std::size_t count = counts[static_cast<std::size_t>(model)];
  // OpenCV's longer forms end with a thin prism and a tilted sensor
  const std::size_t most = model == LensModel::rational_polynomial ? 14 : count;
  if (coefficients.size() > most)
    return fail(Error::Kind::Malformed, fmt::format("lens {}: expected at most {} coefficients, found {}",
                                                    to_string(model), most, coefficients.size()));
  if (!std::all_of(coefficients.begin(), coefficients.end(), [](double c) { return std::isfinite(c); }))
    return fail(Error::Kind::Malformed, fmt::format("lens {}: expected finite coefficients", to_string(model)));
  const auto used = coefficients.first(std::min(count, coefficients.size()));
  const auto beyond = coefficients.subspan(used.size());
  if (std::any_of(beyond.begin(), beyond.end(), [](double c) { return c != 0; }))
    return fail(Error::Kind::Unsupported,
                fmt::format("lens {}: coefficients from the ninth on (thin prism, tilted sensor) are not modelled: "
                            "calibrate without them",
                            to_string(model)));
  Lens lens;
  lens.model_ = model;
  lens.coefficients_.assign(used.begin(), used.end());
  lens.coefficients_.resize(count, 0.0);
  const auto& c = lens.coefficients_;
  lens.ideal_ = model != LensModel::equidistant && std::all_of(c.begin(), c.end(), [](double k) { return k == 0; });
  if (lens.ideal_) return lens;

  std::optional<double> square;  // of where it turns
  if (model == LensModel::equidistant) {
    square = least_sign_change({1, 3 * c[0], 5 * c[1], 7 * c[2], 9 * c[3]}, std::numbers::pi * std::numbers::pi);
    lens.valid_radius_ = square ? std::sqrt(*square) : std::numbers::pi;
  } else {
    const bool rational = model == LensModel::rational_polynomial;
    const Polynomial above = {1, c[0], c[1], c[4]};
    const Polynomial below = rational ? Polynomial{1, c[5], c[6], c[7]} : Polynomial{1};
    // d(r f)/dr = (above below + 2 s (above' below - above below')) / below^2, s = r^2
    Polynomial slope = above * below;
    const Polynomial a = times_slope(above) * below, b = above * times_slope(below);
    for (std::size_t i = 0; i < slope.size(); ++i) slope[i] += 2 * (a[i] - b[i]);
    square = least_sign_change(slope, greatest_square);
    if (const auto pole = least_sign_change(below, greatest_square)) square = std::min(square.value_or(*pole), *pole);
    lens.valid_radius_ = square ? std::sqrt(*square) * (1 - 1e-15) : infinity;  // before a pole, not on it
  }
  lens.greatest_image_radius_ = std::isfinite(lens.valid_radius_) ? lens.radial(lens.valid_radius_) : infinity;
  return lens;
}

/// Image distance of a ray at distance (of equidistant lenses, angle) r.
double Lens::radial(double r) const {
  const auto& c = coefficients_;
  const double s = r * r;
  if (model_ == LensModel::equidistant) return r * (1 + s * (c[0] + s * (c[1] + s * (c[2] + s * c[3]))));
  const double above = 1 + s * (c[0] + s * (c[1] + s * c[4]));
  return model_ == LensModel::plumb_bob ? r * above : r * above / (1 + s * (c[5] + s * (c[6] + s * c[7])));
}

double Lens::radial_slope(double r) const {
  const auto& c = coefficients_;
  const double s = r * r;
  if (model_ == LensModel::equidistant) return 1 + s * (3 * c[0] + s * (5 * c[1] + s * (7 * c[2] + s * 9 * c[3])));
  const double above = 1 + s * (c[0] + s * (c[1] + s * c[4]));
  const double above_slope = c[0] + s * (2 * c[1] + s * 3 * c[4]);
  if (model_ == LensModel::plumb_bob) return above + 2 * s * above_slope;
  const double below = 1 + s * (c[5] + s * (c[6] + s * c[7])), below_slope = c[5] + s * (2 * c[6] + s * 3 * c[7]);
  return (above * below + 2 * s * (above_slope * below - above * below_slope)) / (below * below);
}

/// r with radial(r) = distance: Newton's steps, kept between bounds on both sides, since the radial part only grows.
std::optional<double> Lens::inverse_radial(double distance) const {
  if (!(distance >= 0) || distance > greatest_image_radius_) return std::nullopt;
  double low = 0, high = std::isfinite(valid_radius_) ? valid_radius_ : std::sqrt(greatest_square);
  if (!std::isfinite(valid_radius_) && !(radial(high) >= distance)) return std::nullopt;
  double r = std::min(distance, high);
  for (int i = 0; i < 100; ++i) {
    const double difference = radial(r) - distance;
    (difference > 0 ? high : low) = r;
    if (difference == 0 || high - low <= 1e-16 * high) break;
    double next = r - difference / radial_slope(r);
    if (!(next > low && next < high)) next = low + (high - low) / 2;
    if (std::abs(next - r) <= 1e-16 * r) break;
    r = next;
  }
  return r;
}

Lens::Moved Lens::move(const Eigen::Vector2d& p) const {
  const auto& c = coefficients_;
  const double x = p.x(), y = p.y(), s = p.squaredNorm(), p1 = c[2], p2 = c[3];
  const double above = 1 + s * (c[0] + s * (c[1] + s * c[4])), above_slope = c[0] + s * (2 * c[1] + s * 3 * c[4]);
  double f = above, f_slope = above_slope;  // by s
  if (model_ == LensModel::rational_polynomial) {
    const double below = 1 + s * (c[5] + s * (c[6] + s * c[7])), below_slope = c[5] + s * (2 * c[6] + s * 3 * c[7]);
    f = above / below;
    f_slope = (above_slope - f * below_slope) / below;
  }
  Moved moved;
  moved.point = {x * f + 2 * p1 * x * y + p2 * (s + 2 * x * x), y * f + p1 * (s + 2 * y * y) + 2 * p2 * x * y};
  moved.jacobian << f + 2 * x * x * f_slope + 2 * p1 * y + 6 * p2 * x, 2 * x * y * f_slope + 2 * p1 * x + 2 * p2 * y,
      2 * x * y * f_slope + 2 * p1 * x + 2 * p2 * y, f + 2 * y * y * f_slope + 6 * p1 * y + 2 * p2 * x;
  return moved;
}

std::optional<Eigen::Vector2d> Lens::image_of(const Eigen::Vector3d& ray) const {
  if (model_ == LensModel::equidistant) {
    const double aside = ray.head<2>().norm(), angle = std::atan2(aside, ray.z());
    if (!(angle <= valid_radius_)) return std::nullopt;
    if (aside == 0) return angle == 0 ? std::optional<Eigen::Vector2d>(Eigen::Vector2d::Zero()) : std::nullopt;
    return Eigen::Vector2d(ray.head<2>() * (radial(angle) / aside));
  }
  if (!(ray.z() > 0)) return std::nullopt;
  const Eigen::Vector2d p = ray.head<2>() / ray.z();
  if (ideal_) return p;
  if (!(p.norm() < valid_radius_)) return std::nullopt;
  const Moved moved = move(p);
  if (!(moved.jacobian.determinant() > 0) || !moved.point.allFinite()) return std::nullopt;
  return moved.point;
}

std::optional<Eigen::Vector3d> Lens::ray_of(const Eigen::Vector2d& image) const {
  if (!image.allFinite()) return std::nullopt;
  const double distance = image.norm();
  if (ideal_) return image.homogeneous().normalized();
  if (model_ == LensModel::equidistant) {
    const auto angle = inverse_radial(distance);
    if (!angle) return std::nullopt;
    const double aside = distance > 0 ? std::sin(*angle) / distance : 1;
    return Eigen::Vector3d(image.x() * aside, image.y() * aside, std::cos(*angle));
  }
  // The radial part alone is where the search for the whole begins; near the fold the whole may reach farther.
  const auto start = inverse_radial(std::min(distance, greatest_image_radius_));
  if (!start) return std::nullopt;
  Eigen::Vector2d p = distance > 0 ? Eigen::Vector2d(image * (*start / distance)) : image;
  const auto inside = [&](const Eigen::Vector2d& at, const Moved& moved) {
    return at.norm() < valid_radius_ && moved.jacobian.determinant() > 0 && moved.point.allFinite();
  };
  Moved moved = move(p);
  for (int i = 0; i < 30 && !inside(p, moved); ++i) moved = move(p *= 0.9);  // back from the fold
  for (int i = 0; i < 50 && inside(p, moved); ++i) {
    const Eigen::Vector2d difference = moved.point - image;
    Eigen::Vector2d step = moved.jacobian.inverse() * difference;
    if (!(step.norm() > 1e-15 * (1 + p.norm()))) break;
    // Shorter, where all of it would leave what is valid or lead away
    for (int halvings = 0; halvings < 40; ++halvings, step /= 2) {
      const Moved there = move(p - step);
      if (!inside(p - step, there) || !((there.point - image).norm() <= difference.norm())) continue;
      p -= step;
      moved = there;
      break;
    }
  }
  const auto again = image_of(p.homogeneous());
  const double digits = 1e-10 * (1 + distance);
  if (!again || !((*again - image).norm() <= digits)) return std::nullopt;
  return p.homogeneous().normalized();
}

}  // namespace nadir::render
