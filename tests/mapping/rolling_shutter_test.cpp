#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "every_pixel.h"
#include "nadir/render/patches.h"

namespace nadir::render {
namespace {

using geodesy::Geodetic, geodesy::Projection, geodesy::YawPitchRoll;

constexpr Shutter shutter = {.readout_s = 0.05};

/// Over `origin`, flying east at `speed_mps` and turning, first one way, then faster another one.
CameraMotion motion_over(const Geodetic& origin, double height_m, double speed_mps, double turn_radps,
                         double pitch_deg) {
  Geodetic place = origin;
  place.height_m = height_m;
  const CameraPose start = camera_pose(place, YawPitchRoll::degrees(30, pitch_deg, 5));
  const Eigen::Vector3d east = geodesy::ecef_from_ned(place).rotation * Eigen::Vector3d::UnitY();
  CameraPose pose = start;
  std::vector<Moment> moments;
  for (const double t : {-0.06, -0.01, 0.013, 0.06}) {
    const double step = moments.empty() ? 0 : t - moments.back().time_s;
    const Eigen::Vector3d axis = t > 0 ? Eigen::Vector3d(0, 1, -2) : Eigen::Vector3d(1, 0.5, 0);
    pose.origin = start.origin + t * speed_mps * east;
    pose.rotation = pose.rotation * rotation_by(step * turn_radps * axis);
    moments.push_back({t, pose});
  }
  return CameraMotion::through(std::move(moments)).value();
}

const std::vector<double> barrel = {-0.28, 0.07, 0.0008, -0.0005, 0};

TEST(RollingShutter, EachRowSeesWhatAStillFrameOfItsPoseSees) {
  const Geodetic origin = Geodetic::degrees(47, 9, 0);
  const CameraMotion motion = motion_over(origin, 200, 40, 1.5, 20);
  for (const Lens& lens : {Lens(), Lens::make(LensModel::plumb_bob, barrel).value()})
    for (const Surface& surface : {Surface(Plane(origin, 0)), Surface(Ellipsoid(origin, 0))}) {
      const Camera camera = Camera::pinhole(64, 48, 60, 60, 32, 24).value().with_lens(lens);
      const ExactChain rolling(camera, motion, shutter, surface);
      ASSERT_TRUE(rolling.rolling());
      EXPECT_FALSE(rolling.flat());
      for (int y = 0; y < 48; ++y) {
        const double time_s = shutter.readout_s * ((y + 0.5) / 48 - 0.5);
        const ExactChain still(camera, motion.at(time_s), surface);
        for (const double x : {0.5, 31.0, 60.5}) {
          const auto moved = rolling.enu_from_image({x, y + 0.5}), right = still.enu_from_image({x, y + 0.5});
          ASSERT_TRUE(moved && right);
          EXPECT_NEAR((*moved - *right).norm(), 0, 1e-6) << x << ", " << y;
        }
      }
      const ExactChain global(camera, motion, Shutter{.exposure_s = 0.01}, surface, 0.004);
      EXPECT_FALSE(global.rolling());
      EXPECT_EQ(global.ecef_from_camera().origin, motion.at(0.004).origin);
    }
}

TEST(RollingShutter, PatchesKeepTheToleranceAndWhatIsCertainIsTrue) {
  const Geodetic origin = Geodetic::degrees(47, 9, 0);
  const auto projection = Projection::from_definition("EPSG:4326").value();
  constexpr double tolerance = 0.05;
  double worst_px = 0;
  std::array<std::int64_t, 5> kinds{};
  int looks[3] = {};
  std::mt19937 random(5);
  for (const double height_m : {2.0, 300.0, 400e3})
    for (const double pitch_deg : {0.0, 60.0, 85.0})
      for (const double turn_radps : {0.0, 0.3, 3.0})
        for (const Lens& lens : {Lens(), Lens::make(LensModel::plumb_bob, barrel).value()})
          for (const Surface& surface : {Surface(Plane(origin, 0)), Surface(Ellipsoid(origin, 0))}) {
            const double speed = height_m > 1e5 ? 7600 : 30;
            const Camera camera = Camera::pinhole(128, 96, 90, 90, 64, 48).value().with_lens(lens);
            const ExactChain chain(camera, motion_over(origin, height_m, speed, turn_radps, pitch_deg), shutter,
                                   surface);
            const PatchMapping mapping = map_patches(chain, projection, tolerance, {});
            const Outcome outcome = check_every_pixel(chain, projection, mapping);
            EXPECT_LE(outcome.worst_px, tolerance) << height_m << " m, pitch " << pitch_deg << ", " << turn_radps;
            worst_px = std::max(worst_px, outcome.worst_px);
            for (std::size_t k = 0; k < kinds.size(); ++k) kinds[k] += outcome.pixels[k];

            std::uniform_real_distribution<double> x(0, 128), y(0, 96);
            for (int i = 0; i < 40; ++i) {
              const Eigen::Vector2d one(x(random), y(random)), other(x(random), y(random));
              const Eigen::AlignedBox2d box(one.cwiseMin(other), one.cwiseMax(other));
              const Sight sight = chain.look(box);
              ++looks[static_cast<int>(sight)];
              if (sight == Sight::Some) continue;
              for (double v = 0; v <= 1; v += 0.125)
                for (double u = 0; u <= 1; u += 0.125) {
                  const Eigen::Vector2d at = box.min() + box.sizes().cwiseProduct(Eigen::Vector2d(u, v));
                  if (!camera.ray_of(at)) continue;
                  ASSERT_EQ(chain.enu_from_image(at).has_value(), sight == Sight::All) << at.transpose();
                }
            }
          }
  EXPECT_GT(worst_px, 0.3 * tolerance) << "these views no longer exercise the bound";
  EXPECT_GT(kinds[static_cast<std::size_t>(Patch::Kind::Biquadratic)], 0);
  EXPECT_GT(kinds[static_cast<std::size_t>(Patch::Kind::NoGround)], 0);
  for (const int count : looks) EXPECT_GT(count, 20);
}

TEST(RollingShutter, PatchesEndWhereTheMotionChangesItsVelocity) {
  // A change of turning rate at any row, slow or fast: between the places where patches are checked it could hide
  const Geodetic origin = Geodetic::degrees(47, 9, 0);
  const auto projection = Projection::from_definition("EPSG:4326").value();
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1), around(-0.5, 0.5);
  for (int n = 0; n < 200; ++n) {
    Geodetic place = origin;
    place.height_m = 100;
    const CameraPose middle = camera_pose(place, YawPitchRoll::degrees(30, 40 * unit(random), 5));
    const double change_s = -0.024 + 0.048 * unit(random), turn_radps = std::pow(10.0, -3 + 3.5 * unit(random));
    const Eigen::Vector3d axis = Eigen::Vector3d(around(random), around(random), around(random)).normalized();
    CameraPose before = middle, after = middle;
    before.rotation = middle.rotation * rotation_by(-(change_s + 0.03) * turn_radps * axis);
    after.rotation = middle.rotation * rotation_by(-(0.03 - change_s) * turn_radps * axis);
    const auto motion = CameraMotion::through({{-0.03, before}, {change_s, middle}, {0.03, after}}).value();
    const ExactChain chain(Camera::pinhole(128, 96, 90, 90, 64, 48).value(), motion, shutter, Plane(origin, 0));
    const Outcome outcome = check_every_pixel(chain, projection, map_patches(chain, projection, 0.05, {}));
    EXPECT_LE(outcome.worst_px, 0.05) << "row " << 96 * (change_s / shutter.readout_s + 0.5) << ", " << turn_radps;
  }
}

TEST(RollingShutter, ARowBelowTheGroundSeesNone) {
  const Geodetic origin = Geodetic::degrees(47, 9, 0);
  Geodetic above = origin, below = origin;
  above.height_m = 3;
  below.height_m = -1;
  const auto motion = CameraMotion::through({{-0.025, look_down(above, geodesy::Degrees{0})},
                                             {0.025, look_down(below, geodesy::Degrees{0})}})
                          .value();
  for (const Surface& surface : {Surface(Plane(origin, 0)), Surface(Ellipsoid(origin, 0))}) {
    const ExactChain chain(Camera::pinhole(40, 40, 40, 40, 20, 20).value(), motion, shutter, surface);
    EXPECT_TRUE(chain.enu_from_image({20, 29}));
    EXPECT_FALSE(chain.enu_from_image({20, 31}));
    const auto mapping = map_patches(chain, Projection::from_definition("EPSG:4326").value(), 0.05, {});
    const Outcome outcome = check_every_pixel(chain, Projection::from_definition("EPSG:4326").value(), mapping);
    EXPECT_LE(outcome.worst_px, 0.05);
  }
}

}  // namespace
}  // namespace nadir::render
