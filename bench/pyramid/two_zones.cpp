#include "two_zones.h"

#include <cpl_conv.h>
#include <fmt/format.h>
#include <gdal.h>
#include <ogr_srs_api.h>

#include <GeographicLib/UTMUPS.hpp>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <numbers>
#include <thread>

#include "nadir/base/files.h"

namespace nadir::bench {
namespace {

namespace fs = std::filesystem;

constexpr double border_deg = 12, south_m = 5'300'000, scene_m = TwoZones::side * TwoZones::texel_m;
constexpr double overlap_texels = 4;  // that each zone's scenes reach beyond the meridian at least

struct Place {
  double lon, lat;  // degrees
};

Place place_of(int zone, double easting, double northing) {
  Place p{};
  double convergence = 0, scale = 0;
  GeographicLib::UTMUPS::Reverse(zone, true, easting, northing, p.lat, p.lon, convergence, scale);
  return p;
}

std::array<double, 2> metres_of(int zone, Place p) {
  int used = 0;
  bool north = true;
  std::array<double, 2> m{};
  GeographicLib::UTMUPS::Forward(p.lat, p.lon, used, north, m[0], m[1], zone);
  return m;
}

/// Where the meridian between the zones lies at a northing.
double easting_of_border(int zone, double northing) {
  double easting = zone == 32 ? 720'000 : 280'000;
  for (int i = 0; i < 4; ++i) easting = metres_of(zone, {border_deg, place_of(zone, easting, northing).lat})[0];
  return easting;
}

/// What the world shows at a place: red a wave along longitude, green one along latitude, blue both, slower.
std::array<double, 3> truth(Place p) {
  constexpr double metres_a_degree = 111'320, wave = 16 * TwoZones::texel_m;
  constexpr double along_lon = metres_a_degree * 0.665 / wave, along_lat = metres_a_degree / wave;  // cos(48.3 degrees)
  const double u = 2 * std::numbers::pi * (p.lon - border_deg) * along_lon;
  const double v = 2 * std::numbers::pi * (p.lat - 48) * along_lat;
  return {128 + 100 * std::sin(u), 128 + 100 * std::sin(v), 128 + 60 * std::sin((u + v) / 5) + 40 * std::sin(u / 17)};
}

/// The truth on `width` x `height` texels of a grid of `zone` that begins at (left, top). Places are interpolated
/// between corners of squares of at most 64 texels. Error: (640 m)^2 / 8 times the curvature of parallels, which is
/// tan(latitude) / radius = 1.8e-7 / m: 0.009 m, a thousandth of a texel.
template <class Sample, class Store>
void paint(int zone, double left, double top, int width, int height, std::vector<Sample>& out, Store store) {
  constexpr int cell = 64;
  constexpr double texel = TwoZones::texel_m;
  for (int y0 = 0; y0 < height; y0 += cell)
    for (int x0 = 0; x0 < width; x0 += cell) {
      std::array<Place, 4> corners{};
      for (std::size_t i = 0; i < 4; ++i)
        corners[i] = place_of(zone, left + (x0 + (i % 2 ? cell : 0)) * texel, top - (y0 + (i / 2 ? cell : 0)) * texel);
      for (int y = y0; y < std::min(y0 + cell, height); ++y)
        for (int x = x0; x < std::min(x0 + cell, width); ++x) {
          const double s = (x - x0 + 0.5) / cell, t = (y - y0 + 0.5) / cell;
          const auto between = [&](double Place::*of) {
            return (1 - t) * ((1 - s) * corners[0].*of + s * corners[1].*of) +
                   t * ((1 - s) * corners[2].*of + s * corners[3].*of);
          };
          const auto value = truth({between(&Place::lon), between(&Place::lat)});
          for (std::size_t c = 0; c < 3; ++c)
            out[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) * 3 + c] =
                store(value[c]);
        }
    }
}

struct CloseDataset {
  void operator()(GDALDatasetH dataset) const { GDALClose(dataset); }
};
using Dataset = std::unique_ptr<void, CloseDataset>;

tl::unexpected<Error> gdal_failed(const std::string& path) {
  return fail(Error::Kind::Io, fmt::format("{}: {}", path, CPLGetLastErrorMsg()));
}

Result<void> write_scene(int zone, double left, double top, const fs::path& path) {
  constexpr int side = TwoZones::side;
  std::vector<unsigned char> texels(std::size_t{side} * side * 3);
  paint(zone, left, top, side, side, texels, [](double v) { return static_cast<unsigned char>(std::lround(v)); });

  const Dataset memory(GDALCreate(GDALGetDriverByName("MEM"), "", side, side, 3, GDT_Byte, nullptr));
  if (!memory) return gdal_failed(path);
  std::array<double, 6> place = {left, TwoZones::texel_m, 0, top, 0, -TwoZones::texel_m};
  GDALSetGeoTransform(memory.get(), place.data());
  OGRSpatialReferenceH crs = OSRNewSpatialReference(nullptr);
  OSRImportFromEPSG(crs, 32600 + zone);
  GDALSetSpatialRef(memory.get(), crs);
  OSRDestroySpatialReference(crs);
  constexpr std::array colours = {GCI_RedBand, GCI_GreenBand, GCI_BlueBand};
  for (int band = 1; band <= 3; ++band) {
    GDALSetRasterNoDataValue(GDALGetRasterBand(memory.get(), band), 0);
    GDALSetRasterColorInterpretation(GDALGetRasterBand(memory.get(), band),
                                     colours[static_cast<std::size_t>(band - 1)]);
  }
  if (GDALDatasetRasterIO(memory.get(), GF_Write, 0, 0, side, side, texels.data(), side, side, GDT_Byte, 3, nullptr, 3,
                          3 * side, 1) != CE_None)
    return gdal_failed(path);
  std::array<std::string, 3> words = {"COMPRESS=DEFLATE", "PREDICTOR=YES", "LEVEL=1"};
  std::array<char*, 4> list = {words[0].data(), words[1].data(), words[2].data(), nullptr};
  const Dataset file(
      GDALCreateCopy(GDALGetDriverByName("COG"), path.c_str(), memory.get(), FALSE, list.data(), nullptr, nullptr));
  if (!file) return gdal_failed(path);
  return {};
}

/// Sums for the shift that explains differences best: value(x) = truth(x + shift), to first order.
struct Fit {
  double xx = 0, xy = 0, yy = 0, dx = 0, dy = 0;
  void add(double difference, double slope_x, double slope_y) {
    xx += slope_x * slope_x;
    xy += slope_x * slope_y;
    yy += slope_y * slope_y;
    dx += difference * slope_x;
    dy += difference * slope_y;
  }
  double length() const {
    const double determinant = xx * yy - xy * xy;
    return std::hypot((dx * yy - dy * xy) / determinant, (dy * xx - dx * xy) / determinant);
  }
};

/// A mosaic and its grid, in metres of zone 32.
struct Mosaic {
  Dataset dataset;
  std::string path;
  double left = 0, top = 0;
  int width = 0, height = 0;

  Result<std::vector<unsigned char>> texels(int x, int y, int w, int h) const {
    std::vector<unsigned char> out(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) * 3);
    if (GDALDatasetRasterIO(dataset.get(), GF_Read, x, y, w, h, out.data(), w, h, GDT_Byte, 3, nullptr, 3, 3 * w, 1) !=
        CE_None)
      return gdal_failed(path);
    return out;
  }
  std::vector<double> truth(int x, int y, int w, int h) const {
    std::vector<double> out(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) * 3);
    paint(32, left + x * TwoZones::texel_m, top - y * TwoZones::texel_m, w, h, out, [](double v) { return v; });
    return out;
  }
};

Result<Mosaic> open_mosaic(const std::string& path) {
  Mosaic m{.dataset = Dataset(GDALOpen(path.c_str(), GA_ReadOnly)), .path = path};
  std::array<double, 6> place{};
  if (!m.dataset || GDALGetGeoTransform(m.dataset.get(), place.data()) != CE_None) return gdal_failed(path);
  if (GDALGetRasterCount(m.dataset.get()) < 3 || std::abs(place[1] - TwoZones::texel_m) > 1e-9 || place[2] != 0 ||
      place[4] != 0 || std::abs(place[5] + TwoZones::texel_m) > 1e-9)
    return fail(Error::Kind::Damaged,
                fmt::format("{}: expected 3 bands in texels of {} m, north up; found {} of {} x {} m", path,
                            TwoZones::texel_m, GDALGetRasterCount(m.dataset.get()), place[1], place[5]));
  m.left = place[0];
  m.top = place[3];
  m.width = GDALGetRasterXSize(m.dataset.get());
  m.height = GDALGetRasterYSize(m.dataset.get());
  return m;
}

}  // namespace

TwoZones::TwoZones(int scenes) {
  for (const int zone : {32, 33}) {
    const int count = zone == 32 ? (scenes + 1) / 2 : scenes / 2;
    const int columns = static_cast<int>(std::ceil(std::sqrt(count / 2.0)));
    for (int i = 0; i < count; ++i) {
      const int row = i / columns, column = i % columns;  // columns count from the border
      const double bottom = south_m + row * scene_m;
      const double a = easting_of_border(zone, bottom), b = easting_of_border(zone, bottom + scene_m);
      const double left =
          zone == 32 ? (std::ceil(std::max(a, b) / texel_m) + overlap_texels) * texel_m - (column + 1) * scene_m
                     : (std::floor(std::min(a, b) / texel_m) - overlap_texels) * texel_m + column * scene_m;
      scenes_.push_back({zone, left, bottom + scene_m, fmt::format("zone{}_{:03}_{:03}.tif", zone, row, column)});
    }
  }
}

std::vector<std::string> TwoZones::names(int zone) const {
  std::vector<std::string> all;
  for (const Scene& scene : scenes_)
    if (scene.zone == zone) all.push_back(scene.name);
  return all;
}

Result<fs::path> TwoZones::write(const fs::path& folder, int threads) const {
  GDALAllRegister();
  const fs::path here = folder / fmt::format("two_zones_{}", scenes_.size());
  std::error_code problem;
  fs::create_directories(here, problem);
  std::atomic<std::size_t> next = 0;
  std::vector<Result<void>> done(scenes_.size());
  {
    std::vector<std::jthread> workers;
    for (int t = 0; t < threads; ++t)
      workers.emplace_back([&] {
        for (std::size_t i = next++; i < scenes_.size(); i = next++) {
          const Scene& scene = scenes_[i];
          const fs::path path = here / scene.name;
          std::error_code ignored;
          if (fs::exists(path, ignored)) continue;
          const fs::path unfinished = folder / ("unfinished_" + scene.name);
          done[i] = write_scene(scene.zone, scene.left, scene.top, unfinished);
          if (done[i]) done[i] = move_into_place(unfinished, path);
        }
      });
  }
  for (const auto& d : done)
    if (!d) return fail(d);
  return here;
}

bool TwoZones::covers(double easting, double northing) const {
  const std::array<double, 2> in_33 = metres_of(33, place_of(32, easting, northing));
  constexpr double margin = 2 * texel_m;
  // Margins count towards the outside of what all scenes of a zone cover, not between them: a point and its
  // neighbours at the margin lie in some scene.
  const auto within = [&](double dx, double dy) {
    return std::any_of(scenes_.begin(), scenes_.end(), [&](const Scene& s) {
      const double x = (s.zone == 32 ? easting : in_33[0]) + dx, y = (s.zone == 32 ? northing : in_33[1]) + dy;
      return x >= s.left && x < s.left + scene_m && y <= s.top && y > s.top - scene_m;
    });
  };
  return within(-margin, -margin) && within(margin, -margin) && within(-margin, margin) && within(margin, margin);
}

Result<MosaicError> TwoZones::errors_of(const std::string& map) const {
  const auto opened = open_mosaic(map);
  if (!opened) return fail(opened);
  const Mosaic& m = *opened;
  MosaicError error;

  // Blocks all over
  constexpr int block = 32, padded = block + 2;
  const int stride = std::max({block, std::max(m.width, m.height) / 50});
  double shifts = 0, squares = 0;
  for (int y = 1; y + block < m.height; y += stride)
    for (int x = 1; x + block < m.width; x += stride) {
      const auto covered = [&](int dx, int dy) {
        return covers(m.left + (x + dx) * texel_m, m.top - (y + dy) * texel_m);
      };
      if (!covered(0, 0) || !covered(block, 0) || !covered(0, block) || !covered(block, block)) continue;
      const auto values = m.texels(x, y, block, block);
      if (!values) return fail(values);
      const auto right = m.truth(x - 1, y - 1, padded, padded);
      Fit fit;
      for (std::size_t j = 0; j < block; ++j)
        for (std::size_t i = 0; i < block; ++i)
          for (std::size_t c = 0; c < 3; ++c) {
            const std::size_t at = ((j + 1) * padded + i + 1) * 3 + c;
            const double difference = (*values)[(j * block + i) * 3 + c] - right[at];
            squares += difference * difference;
            fit.add(difference, (right[at + 3] - right[at - 3]) / 2,
                    (right[at + 3 * padded] - right[at - 3 * padded]) / 2);
          }
      shifts += fit.length() * fit.length();
      error.position_max_texels = std::max(error.position_max_texels, fit.length());
      ++error.blocks;
    }
  if (error.blocks == 0)
    return fail(Error::Kind::Damaged, map + ": no block of it lies where the scenes are; is it in another place?");
  error.position_rms_texels = std::sqrt(shifts / static_cast<double>(error.blocks));
  error.rms = std::sqrt(squares / static_cast<double>(error.blocks * block * block * 3));

  // Along the edge of zone 33's scenes, which lie on top
  constexpr int reach = 4, across = 2 * reach + 1;
  double seam = 0;
  for (const Scene& scene : scenes_) {
    if (scene.zone != 33 || !scene.name.ends_with("_000.tif")) continue;
    for (int row = 0; row < side; row += 8) {
      const auto at = metres_of(32, place_of(33, scene.left, scene.top - (row + 0.5) * texel_m));
      const int x = static_cast<int>(std::floor((at[0] - m.left) / texel_m)) - reach;
      const int y = static_cast<int>(std::floor((m.top - at[1]) / texel_m));
      if (x < 0 || y < 0 || x + across > m.width || y >= m.height) continue;
      const auto values = m.texels(x, y, across, 1);
      if (!values) return fail(values);
      const auto right = m.truth(x, y, across, 1);
      for (std::size_t i = 0; i < across; ++i) {
        if (!covers(m.left + (x + static_cast<int>(i) + 0.5) * texel_m, m.top - (y + 0.5) * texel_m)) continue;
        for (std::size_t c = 0; c < 3; ++c) {
          const double difference = std::abs((*values)[3 * i + c] - right[3 * i + c]);
          seam += difference * difference;
          error.seam_max = std::max(error.seam_max, difference);
        }
        ++error.seam_texels;
      }
    }
  }
  if (error.seam_texels > 0) error.seam_rms = std::sqrt(seam / static_cast<double>(3 * error.seam_texels));
  return error;
}

}  // namespace nadir::bench
