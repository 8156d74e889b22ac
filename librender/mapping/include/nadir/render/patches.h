#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "nadir/render/biquadratic.h"
#include "nadir/render/exact_chain.h"
#include "nadir/render/homography.h"
#include "nadir/render/pixel_rect.h"

namespace nadir::render {

/// Where a map lies on the ground; everywhere where unbounded.
struct GroundExtent {
  Eigen::AlignedBox2d box;                            // of a plane: metres east and north of the scene origin
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // of an ellipsoid: up at the middle, in ECEF, and the greatest
  double radius_rad = 0;                              // angle between it and up anywhere on the map
  bool bounded = true;
};

/// Part of an image with one way from its pixels to CRS coordinates.
struct Patch {
  enum class Kind {
    Homography,   // within the tolerance
    Biquadratic,  // likewise
    PerPixel,     // the exact chain at each pixel centre
    NoGround,     // every pixel sees sky
    OffMap,       // every pixel sees ground that no map covers
  };
  PixelRect rect;
  Kind kind = Kind::NoGround;

  // Homography: crs = crs_origin + apply(crs_from_image, image - corner of rect). Both offsets are small, so that
  // eastings of millions of metres cost no digits.
  Eigen::Matrix3d crs_from_image = Eigen::Matrix3d::Identity();
  Eigen::Vector2d crs_origin = Eigen::Vector2d::Zero();
  // Biquadratic: crs = crs_origin + biquadratic(image - corner of rect).
  Biquadratic biquadratic;
  double error_px = 0;  // greatest backward error found at the points checked

  // PerPixel: CRS coordinates at the pixel centres, rows from the top; NaN where no ground is seen.
  std::vector<Eigen::Vector2d> crs;

  Eigen::Vector2d corner() const { return {rect.x, rect.y}; }

  /// CRS coordinates of the centre of a pixel of the rectangle, counted in the whole image; NaN where no ground is
  /// seen.
  Eigen::Vector2d crs_at(int x, int y) const {
    const Eigen::Vector2d offset(x - rect.x + 0.5, y - rect.y + 0.5);
    switch (kind) {
      case Kind::Homography:
        return crs_origin + apply(crs_from_image, offset);
      case Kind::Biquadratic:
        return crs_origin + biquadratic(offset);
      case Kind::PerPixel:
        return crs[static_cast<std::size_t>((y - rect.y) * rect.width + x - rect.x)];
      case Kind::NoGround:
      case Kind::OffMap:
        break;
    }
    return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
};

/// The way from an image's pixels to a CRS, as patches that tile the image.
struct PatchMapping {
  std::vector<Patch> patches;
  double tolerance_px = 0;
  double error_px = 0;            // greatest of the patches'
  std::int64_t exact_points = 0;  // evaluations of the exact chain it took
};

/// Side of the smallest patch: below it the exact chain is as cheap as checking an approximation.
inline constexpr int smallest_patch_px = 8;
/// Patches above this size are cut at multiples of it, so that blocks of that size lie in one patch.
inline constexpr int block_px = 64;

/// Maps the image to `projection`'s CRS within `tolerance_px` of backward error: the distance, in the image, between a
/// pixel and the exact projection of the ground point used for it.
///
/// One homography through the corners where that holds; where it does not, quadratics along both axes through corners,
/// edges' middles and the middle; else the image is cut in halves until either does. Each is checked against the exact
/// chain where its difference from a smooth mapping peaks: the homography at its centre, its edges' middles and the
/// quarter points, quadratics between their nine places along each axis; half the tolerance is margin for what lies
/// between. `extents`: where the maps are, for leaving out what sees none of them; nothing is left out where it is
/// empty. `rows`: patches that meet none of them are left out; the others are those of the whole image.
PatchMapping map_patches(const ExactChain& chain, const geodesy::Projection& projection, double tolerance_px,
                         const std::vector<GroundExtent>& extents, const RowRange& rows = {});

/// Where a rectangle of CRS coordinates lies on the ground, with a margin of 1 %.
GroundExtent ground_extent(const Surface& surface, const geodesy::Projection& projection,
                           const Eigen::Affine2d& crs_from_texel, double width, double height);

}  // namespace nadir::render
