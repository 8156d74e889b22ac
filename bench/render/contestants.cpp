#include "contestants.h"

#include <fmt/format.h>

#include <algorithm>

namespace nadir::bench {

std::vector<Contestant> contestants() {
  const std::string nadir = "nadir-peer-nadir", opencv = "nadir-peer-opencv", oiio = "nadir-peer-oiio",
                    vips = "nadir-peer-vips", gdal = "nadir-peer-gdal", mesa = "nadir-peer-mesa";
  return {{"nadir draft", nadir, "draft"},
          {"nadir balanced, oversampling 1.1", nadir, "balanced@1.1"},
          {"nadir balanced", nadir, "balanced"},
          {"nadir best", nadir, "best"},
          {"original", opencv, "original"},
          {"GDAL + OpenCV linear", opencv, "window_linear"},
          {"GDAL + OpenCV linear 2x2", opencv, "window_linear_2x2"},
          {"GDAL + OpenCV linear 4x4", opencv, "window_linear_4x4"},
          {"GDAL + OpenCV cubic", opencv, "window_cubic"},
          {"GDAL + OpenCV cubic 2x2", opencv, "window_cubic_2x2"},
          {"OpenImageIO trilinear", oiio, "trilinear", true},
          {"OpenImageIO aniso", oiio, "aniso", true},
          {"libvips bilinear", vips, "bilinear"},
          {"gdalwarp bilinear", gdal, "bilinear"},
          {"gdalwarp average", gdal, "average"},
          {"llvmpipe trilinear", mesa, "trilinear"},
          {"llvmpipe aniso 16x", mesa, "aniso"}};
}

std::vector<Contestant> contestants(const std::vector<std::string>& names) {
  const auto all = contestants();
  std::vector<Contestant> some;
  for (const std::string& name : names)
    some.push_back(*std::find_if(all.begin(), all.end(), [&](const Contestant& one) { return one.name == name; }));
  return some;
}

std::string threads_setting(int threads) { return fmt::format("{} thread{}", threads, threads == 1 ? "" : "s"); }

Result<std::shared_ptr<ViewSetting>> setting_of(const RunOptions& options,
                                                const std::shared_ptr<const Scenery>& scenery, const Pose& pose,
                                                int width, int height, const std::string& codec, double budget) {
  auto setting = std::make_shared<ViewSetting>();
  setting->scenery = scenery;
  setting->scratch = options.scratch;
  const auto repeated = scenery->repeated(pose.wide ? Scenery::wide_side : 0);
  if (!repeated) return fail(repeated);
  setting->texture = setting->map = *repeated;
  if (!pose.wide) {
    const auto built = scenery->built(codec);
    if (!built) return fail(built);
    setting->map = *built;
  }
  const auto map = tile::Map::open(setting->map);
  if (!map) return fail(map);
  const auto view = view_of(pose, width, height, *map);
  if (!view) return fail(view);
  setting->view = *view;
  setting->views = setting->scratch / fmt::format("{}_{}x{}.views", pose.name, width, height);
  if (const auto written = write_views(setting->views, {*view}); !written) return fail(written);
  setting->ideal = ideal_of(*view, scenery->content(), lattice(*view, budget));
  return setting;
}

FrameErrors errors_of(const ViewSetting& setting, std::span<const std::byte> frame) {
  const SampleType type = setting.scenery->type();
  return {deviation(frame, type, setting.ideal, setting.ideal.scene),
          deviation(frame, type, setting.ideal, setting.ideal.image)};
}

PeerCommand command_of(const ViewSetting& setting, const Contestant& contestant, int threads) {
  PeerCommand command{contestant.program,
                      contestant.method,
                      threads,
                      setting.views,
                      {contestant.texture ? setting.texture : setting.map}};
  if (contestant.two_layers) command.maps.push_back(setting.second);
  return command;
}

Result<std::shared_ptr<PeerProcess>> start(const ViewSetting& setting, const Contestant& contestant, int threads) {
  if (const std::string why = why_missing(contestant.program); !why.empty()) return fail(Error::Kind::NotFound, why);
  auto peer = PeerProcess::start(command_of(setting, contestant, threads));
  if (!peer) return fail(peer);
  return std::shared_ptr<PeerProcess>(std::move(*peer));
}

Method method_of(const std::shared_ptr<const ViewSetting>& setting, const Contestant& contestant, int threads,
                 const std::function<void(std::string frame)>& keep) {
  Method method{.name = contestant.name, .setting = threads_setting(threads)};
  const auto started = start(*setting, contestant, threads);
  if (!started) {
    method.left_out = started.error().message;
    return method;
  }
  const std::shared_ptr<PeerProcess> peer = *started;
  // While others have their turn, threads sleep, and memory leaves the caches, or the machine: a frame brings them back
  method.told = [=]() -> Result<Usage> {
    if (const auto awake = peer->frame(setting->index); !awake) return awake;
    return peer->frame(setting->index);
  };
  const auto found = std::make_shared<Result<FrameErrors>>();
  method.counters = [=]() -> std::map<std::string, std::string> {
    auto frame = peer->samples(setting->scratch);
    if (!frame) {
      *found = fail(frame);
      return {};
    }
    *found = errors_of(*setting, std::as_bytes(std::span(*frame)));
    if (keep) keep(std::move(*frame));
    const double peak = setting->scenery->peak();
    const auto& [scene, image] = **found;
    return {{"front", threads_setting(threads)},
            {"error:scene", fmt::format("{:.6g}", scene.rms)},
            {"max_error", fmt::format("{:.4g}", image.max)},
            {"max_error_scene", fmt::format("{:.4g}", scene.max)},
            {"psnr_scene_db", fmt::format("{:.2f}", std::min(scene.psnr(peak), 999.0))},
            {"psnr_image_db", fmt::format("{:.2f}", std::min(image.psnr(peak), 999.0))},
            {"psnr", fmt::format("{:.1f} scene, {:.1f} image", scene.psnr(peak), image.psnr(peak))},
            {"homography_error_px", fmt::format("{:.2g}", setting->view.homography_error_px)}};
  };
  method.error = [=]() -> Result<double> {
    if (!*found) return fail(*found);
    return (*found)->image.rms;
  };
  return method;
}

}  // namespace nadir::bench
