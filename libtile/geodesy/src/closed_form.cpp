#include "closed_form.h"

#include <GeographicLib/Constants.hpp>
#include <GeographicLib/TransverseMercator.hpp>
#include <cmath>
#include <limits>
#include <numbers>

namespace nadir::geodesy {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double equatorial_radius_m = 6378137;

class LonLat : public ClosedForm {
 public:
  bool geographic() const override { return true; }
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

/// Krueger's series to sixth order: 5 nm within 35 degrees of the central meridian (Karney, Transverse Mercator with an
/// accuracy of a few nanometers, 2011), and cut off where PROJ cuts its own: there it is of no use to anyone.
class Utm : public ClosedForm {
 public:
  Utm(int zone, bool south) : meridian_deg_(6 * zone - 183), false_northing_m_(south ? 1e7 : 0) {
    // Rectifying radius, to which PROJ's bound on the normalized easting applies
    const double f = GeographicLib::Constants::WGS84_f(), n = f / (2 - f);
    const double radius = equatorial_radius_m / (1 + n) * (1 + n * n / 4 + n * n * n * n / 64);
    largest_easting_m_ = 2.623395162778 * 0.9996 * radius;
  }

  void forward(std::span<Eigen::Vector2d> points) const override {
    const auto& projection = GeographicLib::TransverseMercator::UTM();
    for (auto& p : points) {
      double x = nan, y = nan;
      if (std::abs(p.y()) <= std::numbers::pi / 2)
        projection.Forward(meridian_deg_, to_degrees(p.y()), to_degrees(p.x()), x, y);
      p = std::abs(x) <= largest_easting_m_ ? Eigen::Vector2d(x + false_easting_m, y + false_northing_m_)
                                            : Eigen::Vector2d(nan, nan);
    }
  }
  void inverse(std::span<Eigen::Vector2d> points) const override {
    const auto& projection = GeographicLib::TransverseMercator::UTM();
    for (auto& p : points) {
      const double x = p.x() - false_easting_m, y = p.y() - false_northing_m_;
      double lat = nan, lon = nan;
      if (std::abs(x) <= largest_easting_m_) projection.Reverse(meridian_deg_, x, y, lat, lon);
      p = {to_radians(lon), to_radians(lat)};
    }
  }

 private:
  static constexpr double false_easting_m = 500000;
  const double meridian_deg_, false_northing_m_;
  double largest_easting_m_ = 0;
};

}  // namespace

std::shared_ptr<const ClosedForm> closed_form(int code) {
  if (code == 4326) return std::make_shared<LonLat>();
  if (code == 3857) return std::make_shared<WebMercator>();
  if (code > 32600 && code <= 32660) return std::make_shared<Utm>(code - 32600, false);
  if (code > 32700 && code <= 32760) return std::make_shared<Utm>(code - 32700, true);
  return nullptr;
}

}  // namespace nadir::geodesy
