#pragma once

#include <memory>
#include <optional>
#include <span>

#include "nadir/geodesy/geodetic.h"

namespace nadir::geodesy {

/// A CRS that is calculated here, without a library.
/// Thread-safe.
class ClosedForm {
 public:
  virtual ~ClosedForm() = default;
  /// Once around the Earth in units of x, where that is a longitude.
  virtual std::optional<double> turn() const { return std::nullopt; }
  /// In place, (lon_rad, lat_rad) to (x, y), degrees or metres, and back. Outside its domain: NaN.
  virtual void forward(std::span<Eigen::Vector2d> points) const = 0;
  virtual void inverse(std::span<Eigen::Vector2d> points) const = 0;
};

/// The closed form of EPSG:`code`: 4326, 3857, UTM (32601 to 32660, 32701 to 32760), polar stereographic (3031, 3413,
/// 3976, 3995, 5041, 5042, 32661, 32761). Null for all others.
std::shared_ptr<const ClosedForm> closed_form(int code);

}  // namespace nadir::geodesy
