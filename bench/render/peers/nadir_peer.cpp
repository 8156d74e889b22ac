// Nadir itself, through its library. Methods: a quality or a filter; behind "@" its oversampling; behind "+" what else:
// "layer", a second layer.
#include "nadir/render/renderer.h"
#include "peer.h"
#include "rule_map.h"

namespace nadir::bench {
namespace {

class NadirPeer : public Peer {
 public:
  NadirPeer(render::Scene scene, render::RenderOptions options, int threads)
      : scene_(std::move(scene)), options_(options), renderer_({.cache_bytes = peer_cache_bytes, .threads = threads}) {}

  Result<void> render(const View& view) override {
    const auto camera = render::Camera::pinhole(view.width, view.height, view.focal_px, view.focal_px, view.width / 2.0,
                                                view.height / 2.0);
    if (!camera) return fail(camera);
    using Rotation = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    const geodesy::Pose<geodesy::frame::Enu, geodesy::frame::Camera> pose{
        Eigen::Quaterniond(Eigen::Map<const Rotation>(view.enu_from_camera.data())),
        Eigen::Map<const Eigen::Vector3d>(view.camera_enu_m.data())};
    auto frame = renderer_.render(scene_, *camera, scene_.surface().frame().ecef_from_enu() * pose, options_);
    if (!frame) return fail(frame);
    frame_ = std::move(*frame);
    return {};
  }

  std::span<const std::byte> samples() const override { return frame_.layer().samples; }

 private:
  render::Scene scene_;
  render::RenderOptions options_;
  render::Renderer renderer_;
  render::Frame frame_;
};

Result<std::unique_ptr<Peer>> open(const PeerSetup& setup) {
  const auto map = open_file_or_rule(setup.maps[0]);
  if (!map) return fail(map);
  auto scene = render::Scene::plane(map->center(), {}).with_layer("map", *map);
  const std::size_t plus = setup.method.find('+');
  const std::string way = setup.method.substr(0, plus);
  const std::size_t at = way.find('@');
  const std::string how = way.substr(0, at);
  if (plus != std::string::npos) {
    const auto second = open_file_or_rule(setup.maps.at(1));
    if (!second) return fail(second);
    scene = scene.with_layer("second", *second);
  }
  if (const auto checked = scene.check(); !checked) return fail(checked);
  render::RenderOptions options;
  if (const auto quality = render::parse_quality(how)) {
    options.quality = *quality;
  } else {
    const auto filter = render::parse_filter(how);
    if (!filter) return fail(filter);
    options.filter = *filter;
  }
  if (at != std::string::npos) options.oversampling = std::stod(way.substr(at + 1));
  return std::make_unique<NadirPeer>(std::move(scene), options, setup.threads);
}

}  // namespace
}  // namespace nadir::bench

int main(int argc, char** argv) { return nadir::bench::run_peer(argc, argv, nadir::bench::open); }
