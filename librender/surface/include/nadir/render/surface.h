#pragma once

#include <variant>

#include "nadir/render/ellipsoid.h"
#include "nadir/render/plane.h"

namespace nadir::render {

/// The ground of a scene. A value.
class Surface {
 public:
  Surface(const Plane& plane) : shape_(plane) {}              // a plane is a surface
  Surface(const Ellipsoid& ellipsoid) : shape_(ellipsoid) {}  // and so is an ellipsoid

  /// Null where it is another shape.
  const Plane* plane() const { return std::get_if<Plane>(&shape_); }
  const Ellipsoid* ellipsoid() const { return std::get_if<Ellipsoid>(&shape_); }

  /// East-north-up at the scene origin.
  const geodesy::LocalFrame& frame() const {
    return std::visit([](const auto& shape) -> const geodesy::LocalFrame& { return shape.frame(); }, shape_);
  }
  /// Above the WGS-84 ellipsoid; of a plane at the scene origin.
  double height_m() const {
    return std::visit([](const auto& shape) { return shape.height_m(); }, shape_);
  }
  /// The surface's up coordinate in that frame, over the scene origin.
  double up_m() const { return height_m() - frame().origin().height_m; }

 private:
  std::variant<Plane, Ellipsoid> shape_;
};

}  // namespace nadir::render
