#include "stability_cases.h"

#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "nadir/render/patches.h"
#include "nadir/render/renderer.h"
#include "reference_chain.h"

namespace nadir::bench {
namespace {

using namespace render;
using geodesy::Geodetic, geodesy::Projection, geodesy::YawPitchRoll;
namespace fs = std::filesystem;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double tolerance_px = 0.05;

/// A view on both surfaces.
struct View {
  int width = 64, height = 48;
  double fx = 60, fy = 60;
  double height_m = 100, lat_deg = 10, lon_deg = 20;  // height above the ground
  double yaw_deg = 15, pitch_deg = 0, roll_deg = 0;   // pitch: from straight down
  double ground_m = 0;                                // above the ellipsoid
  const char* crs = "EPSG:4326";
  Lens lens;
  Sight plane = Sight::All, ellipsoid = Sight::All;  // expected of the whole image
};

std::string_view words_for(Sight sight) {
  return sight == Sight::All ? "ground everywhere" : sight == Sight::None ? "no ground" : "ground and sky";
}

/// What was seen on a grid of pixels over the image, and at all of them where it is small.
struct Seen {
  int ground = 0, sky = 0, wrong_side = 0;  // wrong_side: ground for sky or sky for ground
  double error_px = 0, patch_error_px = 0;
  double over_bound = 0;  // the greatest of an error over what was expected of it
  Sight sight() const { return ground == 0 ? Sight::None : sky == 0 ? Sight::All : Sight::Some; }
};

/// Image shift for the least step of a double longitude or latitude, or of an ECEF coordinate where that is more: what
/// nothing in double can resolve.
double rounding_px(const ReferenceChain& reference, const Eigen::Vector2d& lon_lat) {
  constexpr double earth_radius_m = 6.4e6, ecef_step_m = 9.4e-10;
  double shift = 0;
  for (const int axis : {0, 1}) {
    const double parallel = axis == 0 ? std::max(1e-9, std::cos(lon_lat.y())) : 1;
    const double least = std::max(4.5e-16, ecef_step_m / earth_radius_m / parallel);
    Eigen::Vector2d beside = lon_lat;
    beside[axis] += lon_lat[axis] > 0 ? -least : least;
    const auto from = reference.image_of(lon_lat), to = reference.image_of(beside);
    if (from && to) shift = std::max(shift, static_cast<double>((*to - *from).norm()));
  }
  return shift;
}

const Patch* patch_of(const PatchMapping& mapping, int x, int y) {
  for (const Patch& patch : mapping.patches)
    if (x >= patch.rect.x && y >= patch.rect.y && x < patch.rect.x + patch.rect.width &&
        y < patch.rect.y + patch.rect.height)
      return &patch;
  return nullptr;
}

Seen look_at(const ExactChain& chain, const Projection& projection) {
  const ReferenceChain reference(chain);
  const PatchMapping mapping = map_patches(chain, projection, tolerance_px, {});
  const int width = chain.camera().width_px(), height = chain.camera().height_px();
  const int step_x = std::max(1, width / 64), step_y = std::max(1, height / 64);
  Seen seen;
  for (int y = 0; y < height; y += step_y)
    for (int x = 0; x < width; x += step_x) {
      const Eigen::Vector2d image(x + 0.5, y + 0.5);
      std::array<Eigen::Vector2d, 1> lon_lat;
      chain.lon_lat_from_image(std::span(&image, 1), lon_lat);
      const bool ground = lon_lat[0].allFinite();
      ++(ground ? seen.ground : seen.sky);
      // Planes end before their horizon; both are uncertain by what rounding does to a grazing ray
      if (chain.camera().lens().ideal() && chain.height_above_ground_m() > 0) {
        const double sinks = static_cast<double>(reference.sinks_by_rad(image));
        const double end = chain.surface().plane() ? 0.26 : 1e-6;
        if ((ground && sinks < -1e-9) || (!ground && sinks > end)) ++seen.wrong_side;
      }
      const Patch* patch = patch_of(mapping, x, y);
      const Eigen::Vector2d crs = patch ? patch->crs_at(x, y) : Eigen::Vector2d(nan, nan);
      if (!ground) {
        if (crs.allFinite()) ++seen.wrong_side;
        continue;
      }
      const double error = reference.error_px(image, lon_lat[0]);
      const double rounding = rounding_px(reference, lon_lat[0]);
      seen.error_px = std::max(seen.error_px, error);
      // A few dozen roundings, each of them at most such a step
      seen.over_bound = std::max(seen.over_bound, error / (1e-6 + 32 * rounding));
      std::array<Eigen::Vector2d, 1> in_crs = lon_lat;
      projection.crs_from_lon_lat(in_crs);
      if (!in_crs[0].allFinite()) continue;
      std::array<Eigen::Vector2d, 1> back = {crs};
      projection.lon_lat_from_crs(back);
      const double patch_error = back[0].allFinite() ? reference.error_px(image, back[0]) : infinity;
      seen.patch_error_px = std::max(seen.patch_error_px, patch_error);
      seen.over_bound = std::max(seen.over_bound, patch_error / (tolerance_px + 64 * rounding));
    }
  return seen;
}

ExactChain chain_of(const View& v, bool curved) {
  const Geodetic origin = Geodetic::degrees(v.lat_deg, v.lon_deg, v.ground_m);
  Geodetic place = origin;
  place.height_m = v.ground_m + v.height_m;
  const Camera camera =
      Camera::pinhole(v.width, v.height, v.fx, v.fy, v.width * 0.5, v.height * 0.5).value().with_lens(v.lens);
  const CameraPose pose = camera_pose(place, YawPitchRoll::degrees(v.yaw_deg, v.pitch_deg, v.roll_deg));
  return ExactChain(camera, pose, curved ? Surface(Ellipsoid(origin, v.ground_m)) : Surface(Plane(origin, v.ground_m)));
}

StabilityCase view(std::string name, const View& v) {
  return {"views", std::move(name),
          v.plane == v.ellipsoid
              ? std::string(words_for(v.plane))
              : fmt::format("{} on the plane, {} on the ellipsoid", words_for(v.plane), words_for(v.ellipsoid)),
          [v](const fs::path&) {
            const auto projection = Projection::from_definition(v.crs).value();
            Outcome outcome{true, "", 0.0, {}, 0.0};
            for (const bool curved : {false, true}) {
              const Seen seen = look_at(chain_of(v, curved), projection);
              outcome.as_expected = outcome.as_expected && seen.sight() == (curved ? v.ellipsoid : v.plane) &&
                                    seen.wrong_side == 0 && seen.over_bound <= 1;
              outcome.error_px = std::max(*outcome.error_px, seen.error_px);
              outcome.patch_error_px = std::max(*outcome.patch_error_px, seen.patch_error_px);
              outcome.happened += fmt::format("{}: {}", curved ? ", ellipsoid" : "plane", words_for(seen.sight()));
              if (seen.wrong_side > 0) outcome.happened += fmt::format(", {} on the wrong side", seen.wrong_side);
              if (!(seen.over_bound <= 1)) outcome.happened += fmt::format(", {:.2g} of the bound", seen.over_bound);
            }
            return outcome;
          }};
}

/// A look at the ellipsoid from 1 km above it, along rays that meet it at an angle.
StabilityCase grazing(double angle_rad) {
  const auto run = [=](const fs::path&) {
    constexpr double earth_radius_m = 6378137, height_m = 1000, focal_px = 1000;
    const double from_nadir = std::asin(earth_radius_m / (earth_radius_m + height_m) * std::cos(angle_rad));
    const double range_m = std::cos(from_nadir) * (earth_radius_m + height_m) - earth_radius_m * std::sin(angle_rad);
    // Eastwards along the equator, where the Earth is round
    const ExactChain chain = chain_of({.width = 1,
                                       .height = 1,
                                       .fx = focal_px,
                                       .fy = focal_px,
                                       .height_m = height_m,
                                       .lat_deg = 0,
                                       .yaw_deg = 90,
                                       .pitch_deg = from_nadir * 180 / M_PI},
                                      true);
    const Eigen::Vector2d image(0.5, 0.5);
    std::array<Eigen::Vector2d, 1> lon_lat;
    chain.lon_lat_from_image(std::span(&image, 1), lon_lat);
    if (!lon_lat[0].allFinite()) return Outcome{false, "no ground"};
    const double error_px = ReferenceChain(chain).error_px(image, lon_lat[0]);
    const double on_ground_m = error_px / focal_px * range_m / std::sin(angle_rad);
    return Outcome{
        error_px <= 1e-6, fmt::format("{:.1g} px, {:.3g} km away", error_px, range_m / 1e3), error_px, on_ground_m, {}};
  };
  return {"grazing", fmt::format("grazing_{:g}_rad", angle_rad), "within 1e-6 px", run, angle_rad};
}

template <class T>
std::string message_of(const Result<T>& result) {
  return result ? "accepted" : result.error().message;
}

/// A case that has to end with an error which says what is wrong: `says` is part of it.
template <class Attempt>
StabilityCase refused(std::string name, std::string says, Attempt&& attempt) {
  return {"input", std::move(name), "an error that says: " + says, [=](const fs::path& scratch) {
            const std::string message = attempt(scratch);
            return Outcome{message.find(says) != std::string::npos, message};
          }};
}

/// A map written for a case.
struct Raster {
  int width = 1, height = 1;
  std::string crs = "EPSG:32632";
  std::array<double, 6> geotransform = {500000, 1, 0, 5000000, 0, -1};  // as GDAL has it
  GDALDataType type = GDT_Byte;
  std::optional<double> nodata;
  double value = 100;
};

Result<tile::Map> map_of(const Raster& raster, const fs::path& scratch) {
  GDALAllRegister();
  const std::string path = (scratch / "map.tif").string();
  {
    const std::unique_ptr<GDALDataset, decltype(&GDALClose)> file(
        GetGDALDriverManager()->GetDriverByName("GTiff")->Create(path.c_str(), raster.width, raster.height, 1,
                                                                 raster.type, nullptr),
        &GDALClose);
    if (!file) return fail(Error::Kind::Io, path + ": cannot be made");
    OGRSpatialReference crs;
    crs.SetFromUserInput(raster.crs.c_str());
    crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    file->SetSpatialRef(&crs);
    std::array<double, 6> geotransform = raster.geotransform;
    file->SetGeoTransform(geotransform.data());
    if (raster.nodata) file->GetRasterBand(1)->SetNoDataValue(*raster.nodata);
    file->GetRasterBand(1)->Fill(raster.value);
  }
  return tile::Map::open(path);
}

/// A map of 2^31 - 1 texels a side of a centimetre, whose CRS starts 10,000 km from zero. A small raster of constant
/// value lies at its last texels, the rest is empty.
Result<tile::Map> largest_map(const fs::path& scratch) {
  Raster corner;
  corner.width = corner.height = 256;
  if (const auto written = map_of(corner, scratch); !written) return fail(written);
  constexpr auto vrt =
      R"(<VRTDataset rasterXSize="2147483647" rasterYSize="2147483647">
<SRS>+proj=merc +a=6378137 +b=6378137 +x_0=10000000 +y_0=10000000 +units=m +nadgrids=@null +type=crs</SRS>
<GeoTransform>-737418.235,0.01,0,20737418.235,0,-0.01</GeoTransform>
<VRTRasterBand dataType="Byte" band="1"><NoDataValue>0</NoDataValue><SimpleSource>
<SourceFilename relativeToVRT="1">map.tif</SourceFilename><SourceBand>1</SourceBand>
<SrcRect xOff="0" yOff="0" xSize="256" ySize="256"/>
<DstRect xOff="2147483391" yOff="2147483391" xSize="256" ySize="256"/>
</SimpleSource></VRTRasterBand></VRTDataset>)";
  const std::string path = (scratch / "largest.vrt").string();
  VSILFILE* file = VSIFOpenL(path.c_str(), "wb");
  if (!file) return fail(Error::Kind::Io, path + ": cannot be made");
  VSIFWriteL(vrt, 1, std::char_traits<char>::length(vrt), file);
  VSIFCloseL(file);
  return tile::Map::open(path);
}

/// Straight down over a texel of a map, from so high above the ground that a pixel is as large as a texel there.
Result<CameraPose> over_texel(const tile::Map& map, const Eigen::Vector2d& texel, double height_m) {
  std::array<Eigen::Vector2d, 1> place = {map.crs_from_texel() * texel};
  map.projection().lon_lat_from_crs(place);
  return look_down({place[0].y(), place[0].x(), height_m}, geodesy::Degrees{0});
}

/// A frame of a map, straight down over `texel`, on both surfaces: `valid` is the least and the greatest fraction of
/// valid pixels that is right, and valid pixels have the map's value.
struct FrameView {
  std::function<Result<tile::Map>(const fs::path&)> map;
  Eigen::Vector2d texel;
  int width = 64, height = 64;
  double height_m = 100, focal_px = 100;
  std::array<double, 2> valid;
};

Outcome take_frame(const FrameView& f, const fs::path& scratch) {
  const auto map = f.map(scratch);
  if (!map) return {false, map.error().message};
  Outcome outcome{true, ""};
  for (const bool curved : {false, true}) {
    const auto pose = over_texel(*map, f.texel, f.height_m);
    Geodetic origin = geodesy::geodetic_from_ecef({pose->origin});
    origin.height_m = 0;
    const Scene scene = (curved ? Scene::ellipsoid(origin, 0) : Scene::plane(origin, {})).with_layer("map", *map);
    const Camera camera =
        Camera::pinhole(f.width, f.height, f.focal_px, f.focal_px, f.width * 0.5, f.height * 0.5).value();
    Renderer renderer({.cache_bytes = 32u << 20});
    const auto frame = renderer.render(scene, camera, *pose);
    if (!frame) return {false, frame.error().message};
    const FrameLayer& layer = frame->layer();
    const auto valid = static_cast<double>(std::count(layer.validity.begin(), layer.validity.end(), 1)) /
                       static_cast<double>(layer.validity.size());
    int wrong = 0;
    for (std::size_t i = 0; i < layer.validity.size(); ++i)
      if (layer.validity[i] && layer.type == tile::SampleType::UInt8) wrong += layer.samples[i] != std::byte{100};
    outcome.happened += fmt::format("{}: {:.4g} % valid", curved ? ", ellipsoid" : "plane", 100 * valid);
    if (wrong > 0) outcome.happened += fmt::format(", {} of a wrong value", wrong);
    outcome.as_expected = outcome.as_expected && wrong == 0 && valid >= f.valid[0] && valid <= f.valid[1];
  }
  return outcome;
}

StabilityCase frame(std::string name, std::string expected, const FrameView& f) {
  return {"maps", std::move(name), std::move(expected),
          [f](const fs::path& scratch) { return take_frame(f, scratch); }};
}

/// A frame with a pose that is not one.
std::string render_with(const fs::path& scratch, const std::function<void(CameraPose&)>& spoil) {
  const auto map = map_of({.width = 64, .height = 64}, scratch);
  if (!map) return map.error().message;
  auto pose = over_texel(*map, {32, 32}, 100).value();
  spoil(pose);
  Renderer renderer({.cache_bytes = 16u << 20});
  return message_of(renderer.render(Scene::plane(map->center(), {}).with_layer("map", *map),
                                    Camera::pinhole(32, 32, 30, 30, 16, 16).value(), pose));
}

std::string pinhole(double fx, double cx) { return message_of(Camera::pinhole(64, 48, fx, 60, cx, 24)); }

/// Quadrangles so thin that their homographies have a condition of 1e12: corners have to come back.
Outcome thin_homographies() {
  double worst = 0;
  for (const double thin : {1e-4, 1e-8, 1e-12})
    for (const double far : {1.0, 1e6}) {
      const std::array<Eigen::Vector2d, 4> corners = {
          Eigen::Vector2d(0, 0), {far, thin}, {far, thin * (far + 2)}, {0, 2 * thin}};
      const auto h = homography_from_rectangle(1000, 700, corners);
      if (!h) continue;
      const std::array<Eigen::Vector2d, 4> rectangle = {Eigen::Vector2d(0, 0), {1000, 0}, {1000, 700}, {0, 700}};
      for (std::size_t i = 0; i < 4; ++i) {
        const Eigen::Vector2d error = jacobian(*h, rectangle[i]).inverse() * (apply(*h, rectangle[i]) - corners[i]);
        worst = std::max(worst, std::isfinite(error.norm()) ? error.norm() : infinity);
      }
    }
  return {worst <= 1e-6, fmt::format("corners come back within {:.2g} px", worst), worst, {}, {}};
}

}  // namespace

std::vector<StabilityCase> stability_cases() {
  constexpr double micro_rad_deg = 1e-6 * 180 / M_PI;
  const auto lens = [](LensModel model, const std::vector<double>& k) { return Lens::make(model, k).value(); };
  const Sight none = Sight::None, some = Sight::Some, all = Sight::All;
  std::vector<StabilityCase> cases = {
      view("ordinary", {.height_m = 3000, .pitch_deg = 30}),
      view("microradian_below_horizon",
           {.fx = 1e9, .fy = 1e9, .height_m = 1000, .pitch_deg = 90 - micro_rad_deg, .plane = none, .ellipsoid = none}),
      view("horizon_through_the_image", {.height_m = 1000, .pitch_deg = 90, .plane = some, .ellipsoid = some}),
      view("straight_up", {.pitch_deg = 180, .plane = none, .ellipsoid = none}),
      view("on_the_ground", {.height_m = 0, .plane = none, .ellipsoid = none}),
      view("below_the_ground", {.height_m = -3, .plane = none, .ellipsoid = none}),
      view("one_centimetre_above", {.height_m = 0.01, .pitch_deg = 20}),
      view("one_micrometre_above", {.height_m = 1e-6, .pitch_deg = 20}),
      view("orbit_36000_km", {.fx = 300, .fy = 300, .height_m = 36e6}),
      view("orbit_36000_km_whole_disc", {.fx = 60, .fy = 60, .height_m = 36e6, .plane = all, .ellipsoid = some}),
      view("field_of_view_0.001_deg", {.fx = 4e6, .fy = 4e6, .height_m = 300, .pitch_deg = 30}),
      view("field_of_view_179.9_deg", {.fx = 0.028, .fy = 0.028, .height_m = 300, .plane = all, .ellipsoid = some}),
      view("field_of_view_179.9_deg_aside",
           {.fx = 0.028, .fy = 0.028, .height_m = 300, .pitch_deg = 80, .plane = some, .ellipsoid = some}),
      view("frame_1_x_1", {.width = 1, .height = 1, .fx = 500, .fy = 500}),
      view("frame_20000_x_20000", {.width = 20000, .height = 20000, .fx = 20000, .fy = 20000, .height_m = 3000}),
      view("focal_lengths_1e6_apart", {.fx = 1e5, .fy = 0.1, .pitch_deg = 10, .plane = some, .ellipsoid = some}),
      view("roll_180", {.pitch_deg = 30, .roll_deg = 180, .plane = none, .ellipsoid = none}),
      view("gimbal_lock_nose_up", {.height_m = 1000, .pitch_deg = 90, .roll_deg = 45, .plane = some, .ellipsoid = some}),
      view("gimbal_lock_nose_down", {.height_m = 1000, .pitch_deg = -90, .plane = some, .ellipsoid = some}),
      view("north_pole", {.height_m = 5000, .lat_deg = 90, .lon_deg = 0, .pitch_deg = 10, .crs = "EPSG:3413"}),
      view("south_pole", {.height_m = 5000, .lat_deg = -90, .lon_deg = 0, .pitch_deg = 10, .crs = "EPSG:3031"}),
      view("north_pole_in_longitude_and_latitude", {.height_m = 5000, .lat_deg = 90, .lon_deg = 0, .pitch_deg = 10}),
      view("a_metre_from_the_pole", {.height_m = 100, .lat_deg = 89.99999, .lon_deg = 77}),
      view("antimeridian", {.height_m = 5000, .lon_deg = 180, .pitch_deg = 10}),
      view("antimeridian_in_mercator", {.height_m = 5000, .lon_deg = -180, .pitch_deg = 10, .crs = "EPSG:3857"}),
      view("dead_sea", {.height_m = 200, .lat_deg = 31.5, .lon_deg = 35.5, .pitch_deg = 30, .ground_m = -430}),
      view("mount_everest", {.height_m = 200, .lat_deg = 27.99, .lon_deg = 86.93, .pitch_deg = 30, .ground_m = 8820}),
      view("lens_that_folds_in_the_corner",
           {.height_m = 500, .lens = lens(LensModel::plumb_bob, {-0.9, 0, 0, 0, 0}), .plane = some, .ellipsoid = some}),
      view("lens_with_a_pole",
           {.height_m = 500,
            .lens = lens(LensModel::rational_polynomial, {0, 0, 0, 0, 0, -6, 0, 0}),
            .plane = all,
            .ellipsoid = all}),
      view("fisheye_beyond_90_deg", {.fx = 18,
                                     .fy = 18,
                                     .height_m = 500,
                                     .lens = lens(LensModel::equidistant, {0.01, -0.003, 0, 0}),
                                     .plane = some,
                                     .ellipsoid = some}),
      refused("focal_length_nan", "focal length", [](const fs::path&) { return pinhole(nan, 32); }),
      refused("focal_length_infinite", "focal length", [](const fs::path&) { return pinhole(infinity, 32); }),
      refused("focal_length_denormal", "focal length", [](const fs::path&) { return pinhole(5e-324, 32); }),
      refused("focal_length_1e300", "focal length", [](const fs::path&) { return pinhole(1e300, 32); }),
      refused("principal_point_nan", "principal point", [](const fs::path&) { return pinhole(60, nan); }),
      refused("principal_point_1e300", "principal point", [](const fs::path&) { return pinhole(60, 1e300); }),
      refused("lens_coefficient_nan", "finite",
              [](const fs::path&) {
                return message_of(Lens::make(LensModel::plumb_bob, std::array<double, 5>{nan, 0, 0, 0, 0}));
              }),
      refused("position_nan", "finite position",
              [](const fs::path& s) { return render_with(s, [](CameraPose& p) { p.origin.x() = nan; }); }),
      refused("position_infinite", "finite position",
              [](const fs::path& s) { return render_with(s, [](CameraPose& p) { p.origin.x() = infinity; }); }),
      refused("quaternion_of_length_1.01", "unit quaternion",
              [](const fs::path& s) { return render_with(s, [](CameraPose& p) { p.rotation.coeffs() *= 1.01; }); }),
      refused("quaternion_zero", "unit quaternion",
              [](const fs::path& s) { return render_with(s, [](CameraPose& p) { p.rotation.coeffs().setZero(); }); }),
      refused("quaternion_nan", "unit quaternion",
              [](const fs::path& s) { return render_with(s, [](CameraPose& p) { p.rotation.coeffs()[0] = nan; }); }),
      {"input", "quaternion_of_length_1.0005", "is taken for a unit quaternion: a frame",
       [](const fs::path& s) {
         const std::string said = render_with(s, [](CameraPose& p) { p.rotation.coeffs() *= 1.0005; });
         return Outcome{said == "accepted", said};
       }},
      {"input", "position_1e300", "far out in space: a frame without ground",
       [](const fs::path& s) {
         const std::string said = render_with(s, [](CameraPose& p) { p.origin.x() = 1e300; });
         return Outcome{said == "accepted", said};
       }},
      {"views", "homography_condition_1e12", "corners come back within 1e-6 px", [](const fs::path&) { return thin_homographies(); }},
      frame("map_of_one_texel", "the texel in the middle, invalid around it",
            {.map = [](const fs::path& s) { return map_of({.geotransform = {500000, 10, 0, 5000000, 0, -10}}, s); },
             .texel = {0.5, 0.5},
             .valid = {0.01, 0.5}}),
      frame("map_all_invalid", "no valid pixel",
            {.map =
                 [](const fs::path& s) {
                   return map_of({.width = 300, .height = 300, .nodata = 100.0}, s);
                 },
             .texel = {150, 150},
             .valid = {0, 0}}),
      frame("map_of_nan", "no valid pixel",
            {.map =
                 [](const fs::path& s) {
                   return map_of({.width = 300, .height = 300, .type = GDT_Float32, .value = nan}, s);
                 },
             .texel = {150, 150},
             .valid = {0, 0}}),
      frame("map_of_2147483647_texels_a_side", "valid everywhere",
            {.map = largest_map,
             .texel = {2147483647.0 - 128, 2147483647.0 - 128},
             .focal_px = 1e4,
             .valid = {1, 1}}),
  };
  for (const double angle_rad : {1.0, 0.1, 0.01, 1e-3, 1e-4, 1e-5, 1e-6}) cases.push_back(grazing(angle_rad));
  return cases;
}

}  // namespace nadir::bench
