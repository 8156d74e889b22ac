#include "closed_form.h"

#include <GeographicLib/Constants.hpp>
#include <GeographicLib/TransverseMercator.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace nadir::geodesy {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double equatorial_radius_m = 6378137;

class LonLat : public ClosedForm {
 public:
  std::optional<double> turn() const override { return 360; }
  void forward(std::span<Eigen::Vector2d> points) const override {
    for (auto& p : points) p = {to_degrees(p.x()), to_degrees(p.y())};
  }
  void inverse(std::span<Eigen::Vector2d> points) const override {
    for (auto& p : points) p = {to_radians(p.x()), to_radians(p.y())};
  }
};

/// The sphere's formulas over the ellipsoid's latitudes (EPSG guidance note 7-2, method 1024).
class WebMercator : public ClosedForm {
 public:
  std::optional<double> turn() const override { return 2 * std::numbers::pi * equatorial_radius_m; }
  void forward(std::span<Eigen::Vector2d> points) const override {
    for (auto& p : points) {
      const bool pole = !(std::abs(p.y()) < std::numbers::pi / 2 - 1e-10);
      p = pole ? Eigen::Vector2d(nan, nan)
               : Eigen::Vector2d(equatorial_radius_m * p.x(), equatorial_radius_m * std::asinh(std::tan(p.y())));
    }
  }
  void inverse(std::span<Eigen::Vector2d> points) const override {
    for (auto& p : points) p = {p.x() / equatorial_radius_m, std::atan(std::sinh(p.y() / equatorial_radius_m))};
  }
};

/// Krueger's series to sixth order (Karney, Transverse Mercator with an accuracy of a few nanometers, 2011). On the
/// ground they err by 5 nm to 3900 km beside the meridian and by 0.2 micrometres at 6500 km, and from there on by a
/// thousand times more for each 3500 km: undefined there. That is 50 degrees at the equator. Poles are near all
/// meridians, so beyond them the map goes on.
class Utm : public ClosedForm {
 public:
  Utm(int zone, bool south) : meridian_deg_(6 * zone - 183), false_northing_m_(south ? 1e7 : 0) {}

  void forward(std::span<Eigen::Vector2d> points) const override {
    const auto& projection = GeographicLib::TransverseMercator::UTM();
    for (auto& p : points) {
      // Sine of the angle from the meridian's plane: the reach is at 0.77, and the series returns from 0.99 on.
      const double aside = std::cos(p.y()) * std::sin(p.x() - to_radians(meridian_deg_));
      double x = nan, y = nan;
      if (std::abs(p.y()) <= std::numbers::pi / 2 && std::abs(aside) < 0.8)
        projection.Forward(meridian_deg_, to_degrees(p.y()), to_degrees(p.x()), x, y);
      p = std::abs(x) <= reach_m ? Eigen::Vector2d(x + false_easting_m, y + false_northing_m_)
                                 : Eigen::Vector2d(nan, nan);
    }
  }
  void inverse(std::span<Eigen::Vector2d> points) const override {
    const auto& projection = GeographicLib::TransverseMercator::UTM();
    for (auto& p : points) {
      const double x = p.x() - false_easting_m, y = p.y() - false_northing_m_;
      double lat = nan, lon = nan;
      if (std::abs(x) <= reach_m && std::abs(y) <= half_around_m) projection.Reverse(meridian_deg_, x, y, lat, lon);
      p = {to_radians(lon), to_radians(lat)};
    }
  }

 private:
  static constexpr double false_easting_m = 500000;
  static constexpr double reach_m = 6.5e6;
  // From the equator over a pole to the equator: northings beyond it are those of no place.
  static constexpr double half_around_m = 0.9996 * 2 * 10001965.7293 + 1e-3;
  const double meridian_deg_, false_northing_m_;
};

/// Latitude from conformal latitude on WGS-84, to sixth order in the third flattening (Karney, On auxiliary latitudes,
/// 2022, equation A6): what is left out is below 1e-17 radians.
double latitude_from_conformal(double conformal, double sin_conformal, double cos_conformal) {
  constexpr double f = 1 / 298.257223563, n = f / (2 - f);
  constexpr std::array<double, 6> c = {
      n * (2 + n * (-2.0 / 3 + n * (-2 + n * (116.0 / 45 + n * (26.0 / 45 + n * (-2854.0 / 675)))))),
      n * n * (7.0 / 3 + n * (-8.0 / 5 + n * (-227.0 / 45 + n * (2704.0 / 315 + n * (2323.0 / 945))))),
      n * n * n * (56.0 / 15 + n * (-136.0 / 35 + n * (-1262.0 / 105 + n * (73814.0 / 2835)))),
      n * n * n * n * (4279.0 / 630 + n * (-332.0 / 35 + n * (-399572.0 / 14175))),
      n * n * n * n * n * (4174.0 / 315 + n * (-144838.0 / 6237)),
      n * n * n * n * n * n * (601676.0 / 22275)};
  // Clenshaw's sum of c[k] sin(2 (k + 1) conformal)
  const double sin_2 = 2 * sin_conformal * cos_conformal, cos_2 = 1 - 2 * sin_conformal * sin_conformal;
  double sum = 0, before = 0;
  for (std::size_t k = c.size(); k-- > 0;) before = std::exchange(sum, c[k] + 2 * cos_2 * sum - before);
  return conformal + sum * sin_2;
}

/// Snyder's formulas (Map Projections - A Working Manual, 1987, chapter 21) in a form that keeps its digits up to the
/// pole; a few nm of rounding. The other pole lies at infinity.
class PolarStereographic : public ClosedForm {
 public:
  struct Parameters {
    int code;
    double true_lat_deg, scale;  // there; its sign tells the pole
    double meridian_deg;         // upwards from the south pole, downwards from the north pole
    double false_origin_m;       // x and y of the pole
  };
  explicit PolarStereographic(const Parameters& p)
      : side_(p.true_lat_deg > 0 ? 1 : -1), meridian_(to_radians(p.meridian_deg)), false_origin_m_(p.false_origin_m) {
    // The scale at a latitude is rho / (a m), m the radius of its parallel; at the pole both vanish alike.
    const double lat = to_radians(std::abs(p.true_lat_deg)), es = e * std::sin(lat);
    const double parallel_by_t = p.true_lat_deg == 90 || p.true_lat_deg == -90
                                     ? 2 * std::exp(-e * std::atanh(e)) / std::sqrt(1 - e * e)
                                     : std::cos(lat) / std::sqrt(1 - es * es) / t_from(lat);
    rho_by_t_ = equatorial_radius_m * p.scale * parallel_by_t;
  }

  void forward(std::span<Eigen::Vector2d> points) const override {
    for (auto& p : points) {
      const double lat = side_ * p.y(), lon = p.x() - meridian_;
      const bool defined = lat > -std::numbers::pi / 2 + 1e-10 && lat <= std::numbers::pi / 2;
      const double rho = defined ? rho_by_t_ * t_from(lat) : nan;
      p = {false_origin_m_ + rho * std::sin(lon), false_origin_m_ - side_ * rho * std::cos(lon)};
    }
  }
  void inverse(std::span<Eigen::Vector2d> points) const override {
    for (auto& p : points) {
      const double x = p.x() - false_origin_m_, y = side_ * (p.y() - false_origin_m_);
      const double t = std::hypot(x, y) / rho_by_t_;
      const double over = 1 / (1 + t * t), conformal = std::numbers::pi / 2 - 2 * std::atan(t);
      const double lat = latitude_from_conformal(conformal, (1 - t * t) * over, 2 * t * over);
      p = {meridian_ + std::atan2(x, -y), side_ * lat};
    }
  }

 private:
  static constexpr double e = 0.0818191908426214943;  // eccentricity

  /// Tangent of half the conformal colatitude.
  static double t_from(double lat) {
    const double s = std::sin(lat), c = std::cos(lat);
    return (s > 0 ? c / (1 + s) : (1 - s) / c) * std::exp(e * std::atanh(e * s));
  }

  const double side_, meridian_, false_origin_m_;  // side: 1 north, -1 south
  double rho_by_t_ = 0;
};

/// From the EPSG registry. All are of WGS-84, and x is the easting in all, whichever axis the registry puts first.
constexpr std::array<PolarStereographic::Parameters, 8> polar = {{
    {3413, 70, 1, -45, 0},        // NSIDC Sea Ice Polar Stereographic North
    {3995, 71, 1, 0, 0},          // Arctic Polar Stereographic
    {3031, -71, 1, 0, 0},         // Antarctic Polar Stereographic
    {3976, -70, 1, 0, 0},         // NSIDC Sea Ice Polar Stereographic South
    {32661, 90, 0.994, 0, 2e6},   // UPS North
    {32761, -90, 0.994, 0, 2e6},  // UPS South
    {5041, 90, 0.994, 0, 2e6},    // UPS North, easting first
    {5042, -90, 0.994, 0, 2e6},   // UPS South, easting first
}};

}  // namespace

std::shared_ptr<const ClosedForm> closed_form(int code) {
  if (code == 4326) return std::make_shared<LonLat>();
  if (code == 3857) return std::make_shared<WebMercator>();
  if (code > 32600 && code <= 32660) return std::make_shared<Utm>(code - 32600, false);
  if (code > 32700 && code <= 32760) return std::make_shared<Utm>(code - 32700, true);
  const auto at = std::find_if(polar.begin(), polar.end(), [&](const auto& p) { return p.code == code; });
  return at != polar.end() ? std::make_shared<PolarStereographic>(*at) : nullptr;
}

}  // namespace nadir::geodesy
