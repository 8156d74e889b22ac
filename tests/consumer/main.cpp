// The least program that embeds the renderer: consumer MAP CAMERA.yaml prints the frame's mean and where it looks.
#include <nadir/render/renderer.h>

#include <cstdio>
#include <numeric>
using namespace nadir;

namespace {

int report(const Error& error) {
  std::fprintf(stderr, "%s\n", error.message.c_str());
  return 1;
}

int use(std::span<const std::uint8_t> pixels, const render::Truth& truth) {
  const double mean = std::accumulate(pixels.begin(), pixels.end(), 0.0) / static_cast<double>(pixels.size());
  const Eigen::Vector2d corner = truth.footprint.corners[0]->lon_lat_rad;
  std::printf("mean %.3f valid %.3f top_left %.7f %.7f\n", mean, truth.valid_fraction, geodesy::to_degrees(corner.y()),
              geodesy::to_degrees(corner.x()));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return report({Error::Kind::Malformed, "usage: consumer MAP CAMERA.yaml"});
  auto map = tile::Map::open(argv[1]);
  if (!map) return report(map.error());
  auto camera = render::Camera::from_yaml(argv[2]);
  if (!camera) return report(camera.error());
  render::Renderer renderer({.cache_bytes = 256 << 20});
  auto scene = render::Scene::plane(map->center(), {.height_m = 0.0}).with_layer("eo", *map, {.bands = {1, 2, 3}});
  auto pose = render::look_down(geodesy::Geodetic::degrees(0.350876, 32.594719, 100.0), geodesy::Degrees{90});
  auto frame = renderer.render(scene, *camera, pose, {.quality = render::Quality::balanced});
  if (!frame) return report(frame.error());
  return use(frame->pixels<std::uint8_t>("eo"), frame->truth());
}
