// What does a frame's footprint cost, and its polygons, in each of the ways that it is found?
#include <benchmark/benchmark.h>

#include "nadir/render/geographic_polygon.h"

namespace {

using namespace nadir::render;
using namespace nadir::geodesy;

struct View {
  bool curved, lens;
  double height_m, pitch_deg, focal_px = 1000;
};
constexpr View level{false, false, 3000, 0}, level_curved{true, false, 3000, 0}, level_lens{false, true, 3000, 0},
    horizon{false, false, 3000, 80}, horizon_curved{true, false, 3000, 80}, horizon_lens{false, true, 3000, 80},
    disc{true, false, 36e6, 0, 300};

ExactChain chain_of(const View& view) {
  const Geodetic origin = Geodetic::degrees(38.1, -0.76, 0);
  Geodetic place = origin;
  place.height_m = view.height_m;
  Camera camera = Camera::pinhole(1280, 720, view.focal_px, view.focal_px, 640, 360).value();
  const std::vector<double> barrel = {-0.25, 0.07, 0.001, -0.0005, 0};
  if (view.lens) camera = camera.with_lens(Lens::make(LensModel::plumb_bob, barrel).value());
  const Surface ground = view.curved ? Surface(Ellipsoid(origin, 0)) : Surface(Plane(origin, 0));
  return ExactChain(camera, camera_pose(place, YawPitchRoll::degrees(30, view.pitch_deg, 0)), ground);
}

void BM_Footprint(benchmark::State& state, const View& view) {
  const ExactChain chain = chain_of(view);
  const Projection lon_lat = Projection::from_definition("EPSG:4326").value();
  std::size_t points = 0;
  for (auto _ : state) {
    const Footprint found = footprint(chain, lon_lat);
    points = found.outline_lon_lat_rad.size();
    benchmark::DoNotOptimize(geographic_polygons(found));
  }
  state.counters["points"] = static_cast<double>(points);
}
BENCHMARK_CAPTURE(BM_Footprint, plane, level)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(BM_Footprint, ellipsoid, level_curved)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(BM_Footprint, plane_through_a_lens, level_lens)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(BM_Footprint, plane_with_horizon, horizon)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(BM_Footprint, ellipsoid_with_horizon, horizon_curved)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(BM_Footprint, plane_through_a_lens_with_horizon, horizon_lens)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(BM_Footprint, disc_from_orbit, disc)->Unit(benchmark::kMicrosecond);

}  // namespace
