#include "levels_suite.h"

#include <fmt/format.h>
#include <gdal.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>

#include "builders.h"
#include "nadir/bench/measure.h"
#include "nadir/bench/procedural_tiff.h"
#include "nadir/render/renderer.h"
#include "photo.h"

namespace nadir::bench {
namespace {

namespace fs = std::filesystem;

/// A source, how a map of it is made and rendered, and what is asked.
struct Subject {
  std::string name, source;
  tile::Role role = tile::Role::Optical;
  std::vector<int> bands;
  bool labels() const { return role == tile::Role::Labels; }
  std::vector<std::string> filters() const {
    return labels() ? std::vector<std::string>{"mode", "nearest"}
                    : std::vector<std::string>{"box", "gaussian", "lanczos", "nearest"};
  }
  render::Scene scene(const tile::Map& map) const {
    render::LayerOptions options;
    options.role = role;
    options.bands = bands;
    return render::Scene::plane(map.center(), {}).with_layer("layer", map, options);
  }
};

constexpr std::array texels_a_pixel = {1.4, 2.0, 2.8, 4.0, 5.7};
constexpr double focal_px = 320;

struct View {
  double scale, pitch_deg, yaw_deg;  // scale: texels a pixel at the image's centre
};

std::vector<View> views() {
  std::vector<View> all;
  for (const double scale : texels_a_pixel)
    for (const double pitch : {0.0, 40.0})
      for (const double yaw : {0.0, 33.0}) all.push_back({scale, pitch, yaw});
  return all;
}

render::Camera camera() { return render::Camera::pinhole(160, 120, focal_px, focal_px, 79.5, 59.5).value(); }

/// Looks at the map's centre from where a pixel there spans `scale` texels.
render::CameraPose pose(const tile::Map& map, const View& view) {
  const double pitch = geodesy::to_radians(view.pitch_deg), yaw = geodesy::to_radians(view.yaw_deg);
  const double range = view.scale * map.texel_size_m().x() * focal_px, back = range * std::sin(pitch);
  constexpr double earth_radius_m = 6'371'000;
  geodesy::Geodetic place = map.center();
  place.lat_rad -= back * std::cos(yaw) / earth_radius_m;
  place.lon_rad -= back * std::sin(yaw) / (earth_radius_m * std::cos(place.lat_rad));
  place.height_m = range * std::cos(pitch);
  return render::camera_pose(place, geodesy::YawPitchRoll::degrees(view.yaw_deg, view.pitch_deg, 0));
}

/// A layer's samples as numbers; NaN where a pixel is invalid.
std::vector<double> numbers(const render::FrameLayer& layer) {
  std::vector<double> all(layer.samples.size() / tile::size_bytes(layer.type));
  const auto bands = static_cast<std::size_t>(layer.bands);
  tile::with_sample_type(layer.type, [&]<class T>(T) {
    const T* sample = reinterpret_cast<const T*>(layer.samples.data());
    for (std::size_t i = 0; i < all.size(); ++i)
      all[i] = layer.validity[i / bands] ? static_cast<double>(sample[i]) : std::nan("");
  });
  return all;
}

using Frames = std::vector<std::vector<double>>;

Result<Frames> frames_of(const tile::Map& map, const Subject& subject, const render::RenderOptions& options) {
  render::Renderer renderer;
  const auto scene = subject.scene(map);
  Frames frames;
  for (const View& view : views()) {
    const auto frame = renderer.render(scene, camera(), pose(map, view), options);
    if (!frame) return fail(frame);
    frames.push_back(numbers(frame->layer()));
  }
  return frames;
}

/// The most frequent label among the texels of level 0 under a pixel, by 16 x 16 places in it.
Result<Frames> majority_frames(const tile::Map& map, const Subject& subject) {
  const std::array bands = {1};
  const auto texels = map.read(0, {0, 0, map.width(), map.height()}, bands);
  if (!texels) return fail(texels);
  const auto* labels = reinterpret_cast<const std::uint8_t*>(texels->samples.data());
  render::Renderer renderer;
  const auto scene = subject.scene(map);
  Frames frames;
  for (const View& view : views()) {
    const auto frame = renderer.render(scene, camera(), pose(map, view));
    if (!frame) return fail(frame);
    const auto& layer = frame->layer();
    const Eigen::Matrix3d map_from_image = *frame->truth().map_pixel_from_image_pixel;
    std::vector<double> truth = numbers(layer);
    for (int y = 0; y < layer.height; ++y)
      for (int x = 0; x < layer.width; ++x) {
        constexpr int places = 16;
        std::array<int, 256> found{};
        for (int k = 0; k < places * places; ++k) {
          const Eigen::Vector2d at = (map_from_image * Eigen::Vector3d(x - 0.5 + (k % places + 0.5) / places,
                                                                       y - 0.5 + (k / places + 0.5) / places, 1))
                                         .hnormalized();
          const auto col = static_cast<std::int32_t>(std::lround(at.x())),
                     row = static_cast<std::int32_t>(std::lround(at.y()));
          if (col < 0 || row < 0 || col >= map.width() || row >= map.height()) continue;
          ++found[labels[static_cast<std::size_t>(row) * static_cast<std::size_t>(map.width()) +
                         static_cast<std::size_t>(col)]];
        }
        double& pixel = truth[static_cast<std::size_t>(y * layer.width + x)];
        if (!std::isnan(pixel))
          pixel = static_cast<double>(std::max_element(found.begin(), found.end()) - found.begin());
      }
    frames.push_back(std::move(truth));
  }
  return frames;
}

/// Root of the mean square of differences; of labels the share that differs, in percent.
double error_between(const Frames& frames, const Frames& truth, bool labels, double scale) {
  double sum = 0, count = 0;
  const auto all = views();
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (scale > 0 && all[i].scale != scale) continue;
    for (std::size_t k = 0; k < frames[i].size(); ++k) {
      const double d = frames[i][k] - truth[i][k];
      if (std::isnan(d)) continue;
      sum += labels ? (d != 0 ? 100 : 0) : d * d;
      ++count;
    }
  }
  return labels ? sum / count : std::sqrt(sum / count);
}

Result<std::string> build_by(const std::string& filter, const Subject& subject, const RunOptions& options) {
  const auto nadir = NadirBuild::find();
  if (!nadir) return fail(nadir);
  const std::string map = (fs::path(options.scratch) / fmt::format("{}_{}.tif", subject.name, filter)).string();
  std::string left_out;
  std::vector<std::pair<std::string, std::string>> settings = {{"--role", std::string(tile::to_string(subject.role))},
                                                               {"--filter", filter}};
  const auto built = measure_command(nadir->command({subject.source}, map, settings, left_out));
  if (!built) return fail(built);
  return map;
}

Method rendered_from(const tile::Map& map, const Subject& subject, const std::string& filter, render::Quality quality,
                     const std::shared_ptr<const Frames>& truth) {
  const auto made = std::make_shared<Frames>();
  const bool labels = subject.labels();
  return {.name = filter,
          .setting = labels ? "" : std::string(render::to_string(quality)),
          .run = [=]() -> Result<void> {
            auto frames = frames_of(map, subject, {.quality = quality});
            if (!frames) return fail(frames);
            *made = std::move(*frames);
            return {};
          },
          .error = [=]() -> Result<double> { return error_between(*made, *truth, labels, 0); },
          .counters = [=]() -> std::map<std::string, std::string> {
            std::map<std::string, std::string> all;
            for (const double scale : texels_a_pixel)
              all[fmt::format("error_at_{:.1f}", scale)] =
                  fmt::format("{:.4g}", error_between(*made, *truth, labels, scale));
            return all;
          }};
}

Case filters_of(const RunOptions& options, const std::string& name,
                const std::function<Result<Subject>()>& make_subject) {
  return {name, [=]() -> Result<Comparison> {
            const auto subject = make_subject();
            if (!subject) return fail(subject);
            const bool labels = subject->labels();
            Comparison comparison{.error_unit = labels                               ? "% of pixels"
                                                : subject->role == tile::Role::Radar ? "dB RMS"
                                                                                     : "levels RMS",
                                  .warm_up = false,
                                  .rounds = options.quick ? 1 : 3};
            std::shared_ptr<const Frames> truth;
            for (const std::string& filter : subject->filters()) {
              const auto path = build_by(filter, *subject, options);
              if (!path) return fail(path);
              const auto map = tile::Map::open(*path);
              if (!map) return fail(map);
              if (!truth) {  // from level 0, which all have
                auto frames = labels ? majority_frames(*map, *subject)
                                     : frames_of(*map, *subject, {.filter = render::Filter::Reference});
                if (!frames) return fail(frames);
                truth = std::make_shared<const Frames>(std::move(*frames));
              }
              using render::Quality;
              for (const Quality quality :
                   labels ? std::vector{Quality::draft} : std::vector{Quality::draft, Quality::balanced, Quality::best})
                comparison.methods.push_back(rendered_from(*map, *subject, filter, quality, truth));
            }
            return comparison;
          }};
}

const std::string demo_maps = NADIR_SOURCE_DIR "/sim/demo/maps/";

/// Hills of many sizes.
Result<Subject> elevation(const RunOptions& options) {
  const fs::path path = fs::path(options.scratch) / "hills.tif";
  MapRule rule;
  rule.width = rule.height = 2048;
  rule.bands = 1;
  rule.type = SampleType::f32;
  if (const auto ok = write_map(path, rule, true); !ok) return fail(ok);
  return Subject{"elevation", path.string(), tile::Role::Elevation, {}};
}

/// Eight classes of brightness of the orthophoto.
Result<Subject> labels(const RunOptions& options) {
  const std::string photo = demo_maps + "kampala.tif";
  struct Close {
    void operator()(GDALDatasetH dataset) const { GDALClose(dataset); }
  };
  using Dataset = std::unique_ptr<void, Close>;
  GDALAllRegister();
  const Dataset from(GDALOpen(photo.c_str(), GA_ReadOnly));
  if (!from) return fail(Error::Kind::Io, photo + ": cannot be read");
  const int width = GDALGetRasterXSize(from.get()), height = GDALGetRasterYSize(from.get());
  std::vector<std::uint8_t> green(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const std::string path = (fs::path(options.scratch) / "labels.tif").string();
  const Dataset to(GDALCreate(GDALGetDriverByName("GTiff"), path.c_str(), width, height, 1, GDT_Byte, nullptr));
  std::array<double, 6> place{};
  bool ok = to && GDALRasterIO(GDALGetRasterBand(from.get(), 2), GF_Read, 0, 0, width, height, green.data(), width,
                               height, GDT_Byte, 0, 0) == CE_None;
  for (std::uint8_t& texel : green) texel /= 32;
  ok = ok && GDALGetGeoTransform(from.get(), place.data()) == CE_None &&
       GDALSetGeoTransform(to.get(), place.data()) == CE_None &&
       GDALSetSpatialRef(to.get(), GDALGetSpatialRef(from.get())) == CE_None &&
       GDALRasterIO(GDALGetRasterBand(to.get(), 1), GF_Write, 0, 0, width, height, green.data(), width, height,
                    GDT_Byte, 0, 0) == CE_None;
  if (!ok) return fail(Error::Kind::Io, path + ": cannot be made from " + photo);
  return Subject{"labels", path, tile::Role::Labels, {}};
}

}  // namespace

Suite levels_suite() {
  return {
      "levels", "error of frames by the filter that made the levels", [](const RunOptions& options) {
        const auto demo = [&](const std::string& title, Subject subject) {
          return filters_of(options, title, [subject]() -> Result<Subject> { return subject; });
        };
        return std::vector<Case>{
            demo("optical, 7.5 cm texels", {"orthophoto", demo_maps + "kampala.tif", tile::Role::Optical, {1, 2, 3}}),
            demo("optical, 5 m texels", {"naip", demo_maps + "naip_2014.tif", tile::Role::Optical, {1}}),
            demo("radar in decibels", {"radar", demo_maps + "spain_s1.tif", tile::Role::Radar, {1}}),
            filters_of(options, "elevation", [options] { return elevation(options); }),
            filters_of(options, "labels", [options] { return labels(options); }),
        };
      }};
}

}  // namespace nadir::bench
