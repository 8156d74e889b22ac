#include "render_suite.h"

#include <fmt/format.h>

#include "aims.h"
#include "contestants.h"
#include "convergence.h"
#include "crops.h"
#include "flight_cases.h"
#include "nadir/record/image_files.h"
#include "rule_map.h"

namespace nadir::bench {
namespace {

/// Samples of the map that an ideal picture may take: a second or two.
constexpr double ideal_budget = 1e8;

struct FrameSize {
  int width, height;
  std::string name() const { return fmt::format("{} x {}", width, height); }
};
FrameSize large(const RunOptions& options) { return options.quick ? FrameSize{160, 120} : FrameSize{1920, 1080}; }

Pose pose_named(const std::string& name) {
  for (const Pose& pose : poses())
    if (pose.name == name) return pose;
  return {name};
}

/// Nadir's settings and all peers, warm.
Case one_view(const RunOptions& options, const Pose& pose, const FrameSize& size, const std::vector<int>& threads) {
  const std::string name = fmt::format("{}, {}", pose.name, size.name());
  return {name, [=]() -> Result<Comparison> {
            const auto scenery = std::make_shared<const Scenery>(options, MapKind{});
            auto made = setting_of(options, scenery, pose, size.width, size.height, "none",
                                   options.quick ? ideal_budget / 30 : ideal_budget);
            if (!made) return fail(made);
            const std::shared_ptr<const ViewSetting> setting = *made;
            Comparison comparison{
                .error_unit = "levels RMS", .work = size.width * size.height / 1e6, .work_unit = "Mpixel"};
            comparison.go_on = true;
            const auto crops = std::make_shared<Crops>(setting);
            for (const int n : threads)
              for (const Contestant& contestant : contestants())
                comparison.methods.push_back(method_of(setting, contestant, n, [=](const std::string& frame) {
                  if (n == threads[0]) crops->add(contestant.name, frame);
                }));
            comparison.aims_of = [=](const std::vector<Row>& rows) { return aims_of_view(pose.name, rows); };
            if (!options.pictures.empty() && record::image_files())
              comparison.picture = [=]() -> Result<std::string> {
                const std::string file = fmt::format("render-{}-{}x{}-crops.png", pose.name, size.width, size.height);
                const auto written =
                    crops->write(std::filesystem::path(options.pictures) / file, name + ", a part at 400 %");
                if (!written) return fail(written);
                return file;
              };
            return comparison;
          }};
}

/// The reference filter beside the same definition written anew; and how exact one homography is.
Case reference_filter(const RunOptions& options) {
  return {"the reference filter", [=]() -> Result<Comparison> {
            const auto scenery = std::make_shared<const Scenery>(options, MapKind{});
            Comparison comparison{.error_unit = "levels RMS", .warm_up = false, .go_on = true, .rounds = 1};
            const Contestant reference{"nadir reference", "nadir-peer-nadir", "reference"};
            for (const Pose& pose : poses()) {
              if (options.quick && pose.wide) continue;  // 16384 samples a pixel
              const auto setting = setting_of(options, scenery, pose, 96, 72, "none", ideal_budget);
              if (!setting) return fail(setting);
              Method method = method_of(*setting, reference, 2);
              method.setting = pose.name;
              comparison.methods.push_back(std::move(method));
            }
            return comparison;
          }};
}

/// Other types of samples.
Case other_type(const RunOptions& options, const std::string& name, const MapKind& kind, const Pose& pose) {
  const FrameSize size = options.quick ? large(options) : FrameSize{1280, 720};  // o75 fits their map
  return {fmt::format("{}, {}, {}", name, pose.name, size.name()), [=]() -> Result<Comparison> {
            const auto scenery = std::make_shared<const Scenery>(options, kind);
            const auto setting = setting_of(options, scenery, pose, size.width, size.height, "none",
                                            options.quick ? ideal_budget / 30 : ideal_budget / 4);
            if (!setting) return fail(setting);
            Comparison comparison{.error_unit = "RMS", .work = size.width * size.height / 1e6, .work_unit = "Mpixel"};
            comparison.go_on = true;
            for (const Contestant& contestant : contestants(
                     {"nadir draft", "nadir balanced", "nadir best", "GDAL + OpenCV linear", "GDAL + OpenCV linear 2x2",
                      "OpenImageIO trilinear", "libvips bilinear", "gdalwarp bilinear"}))
              comparison.methods.push_back(method_of(*setting, contestant, 2));
            comparison.aims = {{.method = label("nadir draft", threads_setting(2)),
                                .baseline = label("GDAL + OpenCV linear", threads_setting(2)),
                                .most = 0.5}};
            return comparison;
          }};
}

/// What a second layer of the same geometry adds to the first.
Case second_layer(const RunOptions& options) {
  const FrameSize size = large(options);
  return {fmt::format("two layers, n1, {}", size.name()), [=]() -> Result<Comparison> {
            const auto scenery = std::make_shared<const Scenery>(options, MapKind{});
            const auto setting = setting_of(options, scenery, pose_named("n1"), size.width, size.height, "none", 1e5);
            if (!setting) return fail(setting);
            const auto second = scenery->built("zstd");
            if (!second) return fail(second);
            (*setting)->second = *second;
            Comparison comparison{.error_unit = "levels RMS"};
            for (Contestant one : contestants({"nadir draft", "nadir balanced"}))
              for (const int threads : {1, 2}) {
                comparison.methods.push_back(method_of(*setting, one, threads));
                Contestant two = one;
                two.name += ", two layers";
                two.method += "+layer";
                two.two_layers = true;
                comparison.methods.push_back(method_of(*setting, two, threads));
                comparison.aims.push_back({.method = label(two.name, threads_setting(threads)),
                                           .baseline = label(one.name, threads_setting(threads)),
                                           .most = 1.8});
              }
            return comparison;
          }};
}

/// Fresh processes over a packed map in the page cache.
Case cold_start(const RunOptions& options, const Pose& pose) {
  const FrameSize size = large(options);
  return {
      fmt::format("cold, {}, {}", pose.name, size.name()), [=]() -> Result<Comparison> {
        const auto scenery = std::make_shared<const Scenery>(options, MapKind{});
        auto made = setting_of(options, scenery, pose, size.width, size.height, "zstd", 1);
        if (!made) return fail(made);
        const std::shared_ptr<const ViewSetting> setting = *made;
        Comparison comparison;
        comparison.go_on = true;
        const std::string open = "open and first frame", whole = "whole process";
        for (const Contestant& contestant :
             contestants({"nadir draft", "nadir balanced", "GDAL + OpenCV linear", "OpenImageIO trilinear",
                          "libvips bilinear", "gdalwarp bilinear"}))
          for (const std::string& what : {open, whole}) {
            Method method{.name = contestant.name, .setting = what};
            method.left_out = why_missing(contestant.program);
            method.told = [=]() -> Result<Usage> {
              auto found = cold_frame(command_of(*setting, contestant, 2), setting->index);
              if (!found) return fail(found);
              Usage usage = found->open_and_first;
              if (what == whole) usage.wall_ms = found->process_ms;
              return usage;
            };
            comparison.methods.push_back(std::move(method));
          }
        for (const std::string quality : {"nadir draft", "nadir balanced"})
          for (const auto& [what, times] : {std::pair{open, 3.0}, {whole, 2.0}})
            comparison.aims.push_back(
                {.method = label(quality, what), .baseline = label("GDAL + OpenCV linear", what), .most = 1 / times});
        return comparison;
      }};
}

/// Time and memory for maps of any size, by rule.
Case growth(const RunOptions& options, const Pose& pose) {
  const FrameSize size = options.quick ? FrameSize{160, 120} : FrameSize{320, 240};  // o75 fits the smallest map
  return {fmt::format("growth with the map, {}, {}", pose.name, size.name()), [=]() -> Result<Comparison> {
            Comparison comparison;
            const auto nadir = contestants({"nadir balanced"})[0];
            const std::uint64_t promise =
                (256u << 20) + (64u << 20) +
                static_cast<std::uint64_t>(size.width) * static_cast<std::uint64_t>(size.height) * 4;
            std::vector<std::string> labels;
            for (const int exponent : {12, 14, 17, 30}) {
              const std::int64_t side = std::int64_t{1} << exponent;
              // The largest map still fits its zone
              const double texel_m = exponent == 30 ? usual_texel_m / 1024 : usual_texel_m;
              auto setting = std::make_shared<ViewSetting>();
              setting->map = rule_map_name(side, texel_m);
              const auto map = open_file_or_rule(setting->map);
              if (!map) return fail(map);
              const auto view = view_of(pose, size.width, size.height, *map, texel_m);
              if (!view) return fail(view);
              setting->view = *view;
              setting->views = std::filesystem::path(options.scratch) / fmt::format("growth_{}.views", exponent);
              if (const auto written = write_views(setting->views, {*view}); !written) return fail(written);
              const auto peer = start(*setting, nadir, 1);
              if (!peer) return fail(peer);
              Method method{.name = nadir.name, .setting = fmt::format("2^{} texels a side", exponent)};
              method.told = [peer = *peer] { return peer->frame(0); };
              method.counters = [peer = *peer, promise]() -> std::map<std::string, std::string> {
                const auto usage = peer->frame(0);
                if (!usage || !usage->peak_bytes) return {};
                const double of = static_cast<double>(*usage->peak_bytes) / static_cast<double>(promise);
                return {{"peak_ratio:cache, frame and 64 MiB", fmt::format("{:.4g}", of)},
                        {"peak_aim:cache, frame and 64 MiB", "1"}};
              };
              method.point =
                  Point{"growth with the map, " + pose.name, static_cast<double>(side), "side of the map, texels"};
              labels.push_back(label(method.name, method.setting));
              comparison.methods.push_back(std::move(method));
            }
            for (std::size_t i = 1; i < labels.size(); ++i)
              comparison.aims.push_back({.method = labels[i], .baseline = labels[0], .most = 1.1});
            return comparison;
          }};
}

std::vector<Case> all_cases(const RunOptions& options) {
  std::vector<Case> cases;
  if (options.quick) {
    for (const std::string name : {"n1", "n64", "o75"})
      cases.push_back(one_view(options, pose_named(name), large(options), {1, 2}));
  } else {
    for (const Pose& pose : poses()) cases.push_back(one_view(options, pose, {640, 480}, {1}));
    for (const Pose& pose : poses()) cases.push_back(one_view(options, pose, large(options), {1, 2}));
  }
  cases.push_back(reference_filter(options));
  for (Case& one : convergence_cases(options)) cases.push_back(std::move(one));
  cases.push_back(flicker(options));
  cases.push_back(second_layer(options));
  for (const std::string name : {"n1", "o75"}) {
    if (options.quick && name != "o75") continue;
    cases.push_back(cold_start(options, pose_named(name)));
    cases.push_back(growth(options, pose_named(name)));
  }
  cases.push_back(steady_flight(options));
  for (const std::string name : {"n1", "o75", "low4"}) {
    if (options.quick && name != "o75") continue;
    cases.push_back(other_type(options, "u16 x 4", {SampleType::u16, 4, 8192}, pose_named(name)));
    cases.push_back(other_type(options, "f32 x 1", {SampleType::f32, 1, 8192}, pose_named(name)));
  }
  return cases;
}

}  // namespace

Suite render_suite() {
  return {"render", "frames beside OpenCV, OpenImageIO, libvips, gdalwarp and llvmpipe", all_cases};
}

}  // namespace nadir::bench
