#include "mapping_suite.h"

#include <fmt/format.h>
#include <gdal_alg.h>

#include <Eigen/LU>
#include <cmath>
#include <memory>

#include "nadir/render/patches.h"

namespace nadir::bench {
namespace {

using namespace render;
using geodesy::Geodetic, geodesy::Projection, geodesy::YawPitchRoll;

struct Scene {
  std::string name, crs;
  bool curved = false;
  double height_m = 3000, pitch_deg = 30;
  Lens lens;
};

Lens lens(LensModel model, const std::vector<double>& coefficients) { return Lens::make(model, coefficients).value(); }

std::vector<Scene> scenes() {
  const Lens barrel = lens(LensModel::plumb_bob, {-0.28, 0.07, 0.0008, -0.0005, 0}),
             rational = lens(LensModel::rational_polynomial, {0.3, 0.1, 0.0005, -0.0005, 0.01, 0.5, 0.2, 0.02}),
             fisheye = lens(LensModel::equidistant, {0.01, -0.003, 0.0005, 0});
  return {{"plane, UTM", "EPSG:32632"},
          {"plane, longitude and latitude", "EPSG:4326"},
          {"plane, a CRS of PROJ (Lambert, 3035)", "EPSG:3035"},
          {"ellipsoid, UTM", "EPSG:32632", true},
          {"ellipsoid, a CRS of PROJ (Lambert, 3035)", "EPSG:3035", true},
          {"ellipsoid from 400 km, longitude and latitude", "EPSG:4326", true, 400e3},
          {"plane towards the horizon, UTM", "EPSG:32632", false, 3000, 80},
          {"plane, UTM, plumb_bob", "EPSG:32632", false, 3000, 30, barrel},
          {"plane, UTM, rational_polynomial", "EPSG:32632", false, 3000, 30, rational},
          {"plane, UTM, equidistant", "EPSG:32632", false, 3000, 30, fisheye}};
}

/// All that the methods of a case share.
struct Setting {
  ExactChain chain;
  Projection projection;
  std::vector<Eigen::Vector2d> image, exact;  // of every pixel centre, rows from the top
  int width() const { return chain.camera().width_px(); }
  int height() const { return chain.camera().height_px(); }
};
using Coordinates = std::vector<Eigen::Vector2d>;

std::shared_ptr<const Setting> setting_of(const Scene& scene, bool quick) {
  const int width = quick ? 160 : 1280, height = quick ? 90 : 720;
  const Geodetic origin = Geodetic::degrees(48, 10, 0);
  const Camera camera =
      Camera::pinhole(width, height, 0.8 * width, 0.8 * width, width * 0.5, height * 0.5).value().with_lens(scene.lens);
  Geodetic place = origin;
  place.height_m = scene.height_m;
  const Surface surface = scene.curved ? Surface(Ellipsoid(origin, 0)) : Surface(Plane(origin, 0));
  auto setting = std::make_shared<Setting>(
      Setting{ExactChain(camera, camera_pose(place, YawPitchRoll::degrees(40, scene.pitch_deg, 3)), surface),
              Projection::from_definition(scene.crs).value(),
              {},
              {}});
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) setting->image.emplace_back(x + 0.5, y + 0.5);
  setting->exact.resize(setting->image.size());
  setting->chain.crs_from_image(setting->projection, setting->image, setting->exact);
  return setting;
}

/// Coordinates of every pixel by a mapping's patches.
void evaluate(const PatchMapping& mapping, int width, Coordinates& out) {
  for (const Patch& patch : mapping.patches)
    for (int y = patch.rect.y; y < patch.rect.y + patch.rect.height; ++y) {
      Eigen::Vector2d* row = &out[static_cast<std::size_t>(y) * static_cast<std::size_t>(width)];
      for (int x = patch.rect.x; x < patch.rect.x + patch.rect.width; ++x) row[x] = patch.crs_at(x, y);
    }
}

/// The greatest backward error, in pixels, where the slope between neighbours tells one.
double greatest_error_px(const Setting& s, const Coordinates& found) {
  double worst = 0;
  for (int y = 0; y + 1 < s.height(); ++y)
    for (int x = 0; x + 1 < s.width(); ++x) {
      const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(s.width()) + static_cast<std::size_t>(x);
      Eigen::Matrix2d slope;
      slope << s.exact[at + 1] - s.exact[at], s.exact[at + static_cast<std::size_t>(s.width())] - s.exact[at];
      const double error = (slope.inverse() * (found[at] - s.exact[at])).norm();
      if (slope.allFinite() && std::isfinite(error)) worst = std::max(worst, error);
    }
  return worst;
}

Method by_patches(const std::shared_ptr<const Setting>& s, double tolerance_px) {
  const auto found = std::make_shared<Coordinates>(s->image.size());
  const auto mapping = std::make_shared<PatchMapping>();
  return {.name = "nadir",
          .setting = fmt::format("{:g} px", tolerance_px),
          .run = [=]() -> Result<void> {
            *mapping = map_patches(s->chain, s->projection, tolerance_px, {});
            evaluate(*mapping, s->width(), *found);
            return {};
          },
          .error = [=]() -> Result<double> { return greatest_error_px(*s, *found); },
          .counters = [=]() -> std::map<std::string, std::string> {
            return {{"patches", std::to_string(mapping->patches.size())},
                    {"exact_points", std::to_string(mapping->exact_points)}};
          }};
}

Method by_every_pixel(const std::shared_ptr<const Setting>& s) {
  const auto found = std::make_shared<Coordinates>(s->image.size());
  return {.name = "the exact chain for each pixel",
          .run = [=]() -> Result<void> {
            s->chain.crs_from_image(s->projection, s->image, *found);
            return {};
          },
          .error = [=]() -> Result<double> { return greatest_error_px(*s, *found); }};
}

/// The exact chain as GDAL's transformers are called: x and y are pixels before, CRS coordinates after.
int transform(void* of, int, int count, double* x, double* y, double*, int* success) {
  const auto& s = *static_cast<const Setting*>(of);
  Coordinates image, crs(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) image.emplace_back(x[i], y[i]);
  s.chain.crs_from_image(s.projection, image, crs);
  for (int i = 0; i < count; ++i) {
    x[i] = crs[static_cast<std::size_t>(i)].x();
    y[i] = crs[static_cast<std::size_t>(i)].y();
    success[i] = crs[static_cast<std::size_t>(i)].allFinite();
  }
  return TRUE;
}

/// GDAL's approximating transformer, row by row as its warper calls it. Its tolerance is in CRS units: those of a pixel
/// at the image's middle.
Method by_gdal(const std::shared_ptr<const Setting>& s, double tolerance_px) {
  const auto found = std::make_shared<Coordinates>(s->image.size());
  const std::size_t width = static_cast<std::size_t>(s->width()),
                    middle = (static_cast<std::size_t>(s->height()) / 2) * width + width / 2;
  const double pixel = (s->exact[middle + 1] - s->exact[middle]).norm();
  return {.name = "GDAL's approximate transformer",
          .setting = fmt::format("{:g} px", tolerance_px),
          .run = [=]() -> Result<void> {
            struct Destroy {
              void operator()(void* t) const { GDALDestroyApproxTransformer(t); }
            };
            const std::unique_ptr<void, Destroy> approximate(
                GDALCreateApproxTransformer(transform, const_cast<Setting*>(s.get()), tolerance_px * pixel));
            std::vector<double> x(width), y(width), z(width);
            std::vector<int> success(width);
            for (std::size_t row = 0; row < static_cast<std::size_t>(s->height()); ++row) {
              for (std::size_t i = 0; i < width; ++i) {
                x[i] = s->image[row * width + i].x();
                y[i] = s->image[row * width + i].y();
              }
              GDALApproxTransform(approximate.get(), FALSE, static_cast<int>(width), x.data(), y.data(), z.data(),
                                  success.data());
              for (std::size_t i = 0; i < width; ++i) (*found)[row * width + i] = {x[i], y[i]};
            }
            return {};
          },
          .error = [=]() -> Result<double> { return greatest_error_px(*s, *found); }};
}

Case one_scene(const Scene& scene, const RunOptions& options) {
  return {scene.name, [=]() -> Result<Comparison> {
            const auto setting = setting_of(scene, options.quick);
            Comparison comparison{
                .error_unit = "px", .work = static_cast<double>(setting->image.size()) / 1e6, .work_unit = "Mpixel"};
            for (const double tolerance : {1.0, 0.05, 1e-3, 1e-4})
              comparison.methods.push_back(by_patches(setting, tolerance));
            comparison.methods.push_back(by_every_pixel(setting));
            for (const double tolerance : {0.125, 0.05}) comparison.methods.push_back(by_gdal(setting, tolerance));
            const std::string ours = label("nadir", "0.05 px");
            comparison.aims = {
                {.method = ours, .baseline = "the exact chain for each pixel"},
                {.method = ours, .baseline = label("GDAL's approximate transformer", "0.05 px"), .most = 1.0}};
            return comparison;
          }};
}

}  // namespace

Suite mapping_suite() {
  return {"mapping", "from pixels to CRS coordinates: error against run time over the tolerance",
          [](const RunOptions& options) {
            std::vector<Case> cases;
            for (const Scene& scene : scenes()) cases.push_back(one_scene(scene, options));
            return cases;
          }};
}

}  // namespace nadir::bench
