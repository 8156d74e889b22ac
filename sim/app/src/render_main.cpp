// nadir render: camera frames and ground truth for given poses.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <set>

#include "explanation_json.h"
#include "nadir/base/files.h"
#include "nadir/base/progress.h"
#include "nadir/base/text.h"
#include "nadir/base/time.h"
#include "nadir/record/dataset.h"
#include "nadir/record/overview.h"
#include "nadir/record/scratch_dataset.h"
#include "nadir/record/time_budget_record.h"
#include "nadir/render/adaptive_quality.h"
#include "nadir/sim/pose_file.h"
#include "render_arguments.h"
#include "tell_time_budget.h"

namespace nadir::app {
namespace {

struct Summary {
  std::size_t frames = 0, rejected = 0, blank = 0;  // blank: frames without one valid pixel
  std::size_t in_bands = 0;
  std::size_t coarse = 0;   // frames with pixels from coarser levels than planned
  std::size_t damaged = 0;  // frames that saw damaged tiles
  std::set<std::string> damage;
  double seconds = 0;
  std::vector<render::StageTimes> times;           // of each frame
  std::optional<render::Explanation> explanation;  // of the first frame
  std::string time_budget;                         // its record, where there is one
  double budget_ms = 0;

  /// Each stage's own median.
  render::StageTimes median() const {
    render::StageTimes median;
    if (times.empty()) return median;
    for (const auto stage : render::stages) {
      std::vector<double> ms;
      for (const render::StageTimes& one : times) ms.push_back(one.*stage.ms);
      std::nth_element(ms.begin(), ms.begin() + static_cast<std::ptrdiff_t>(ms.size() / 2), ms.end());
      median.*stage.ms = ms[ms.size() / 2];
    }
    return median;
  }
  /// Frames over the time budget.
  std::ptrdiff_t late() const {
    return std::count_if(times.begin(), times.end(),
                         [&](const render::StageTimes& t) { return t.whole_ms > budget_ms; });
  }
};

void print_json(const Summary& summary, const render::Renderer& renderer, const std::string& folder) {
  const tile::CacheCounters cache = renderer.cache_counters();
  nlohmann::ordered_json json = {
      {"frames", summary.frames},
      {"rejected", summary.rejected},
      {"damaged", summary.damaged},
      {"blank", summary.blank},
      {"coarse", summary.coarse},
      {"in_bands", summary.in_bands},
      {"seconds", summary.seconds},
      {"median_frame_ms", summary.median().whole_ms},
      {"median_times", to_json(summary.median())},
      {"cells_loaded", cache.loads},
      {"cells_evicted", cache.evictions},
      {"cache_peak_bytes", cache.peak_bytes},
      {"frame_memory_peak_bytes", renderer.frame_memory_counters().peak_bytes},
      {"folder", folder.empty() ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(folder)}};
  if (summary.explanation) json["explain"] = to_json(*summary.explanation);
  if (!summary.time_budget.empty()) {
    json["time_budget"] = nlohmann::ordered_json::parse(summary.time_budget);
    json["late"] = summary.late();
  }
  fmt::print("{}\n", json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

void print_text(const Summary& summary, const std::string& folder, bool pictures) {
  fmt::print("{} frames in {:.1f} s, {:.1f} ms each in the renderer (median)", summary.frames, summary.seconds,
             summary.median().whole_ms);
  if (!summary.time_budget.empty()) fmt::print(", {} over the time budget", summary.late());
  if (summary.rejected > 0) fmt::print(", {} rejected: they look beyond the map", summary.rejected);
  if (summary.in_bands > 0) fmt::print(", in bands of rows");
  if (summary.coarse > 0) fmt::print(", {} of them partly from coarser levels than planned", summary.coarse);
  if (!folder.empty())
    fmt::print("\n{0}/frames.jsonl holds the truth{1}", folder,
               pictures ? fmt::format("; look at {}/*.png", folder) : "");
  fmt::print("\n");
}

void print_explanation(const render::Explanation& explanation) {
  const render::ExplanationText text = render::to_text(explanation);
  fmt::print("the first frame, {}\n", render::to_text(explanation.counters.times));
  for (const std::string& line : text.done) fmt::print("  {}\n", line);
  fmt::print("left out\n");
  for (const std::string& line : text.left_out) fmt::print("  {}\n", line);
}

double time_s(const sim::TimedPose& pose) { return seconds_from_ns(pose.time_ns); }

/// Where the first camera and the first map are, for somebody whose frames show nothing.
std::string whereabouts(const render::Scene& scene, const sim::TimedPose& pose) {
  const geodesy::Geodetic camera = geodesy::geodetic_from_ecef({pose.ecef_from_camera.origin});
  const tile::Map& map = scene.layers().front().source->map();
  return fmt::format(
      "the first camera is at {:.6f}, {:.6f} (lat, lon) and {:.6g} m, the centre of {} at {:.6f}, {:.6f}",
      geodesy::to_degrees(camera.lat_rad), geodesy::to_degrees(camera.lon_rad), camera.height_m, map.description().path,
      geodesy::to_degrees(map.center().lat_rad), geodesy::to_degrees(map.center().lon_rad));
}

/// The message, with the option that helps.
std::string advice(const Error& error) {
  return error.message + (error.kind == Error::Kind::OverBudget ? " with --cache" : "");
}

bool is_blank(const render::Frame& frame) {
  return std::all_of(frame.layers().begin(), frame.layers().end(),
                     [](const render::FrameLayer& layer) { return layer.truth.valid_fraction == 0; });
}

/// The motion that the poses describe; empty where the shutter is instant, and nobody asks.
Result<std::optional<render::CameraMotion>> motion_of(const std::vector<sim::TimedPose>& poses,
                                                      const render::Shutter& shutter) {
  if (auto ok = render::check(shutter); !ok) return fail(ok.error().kind, "--" + ok.error().message);
  if (shutter.instant()) return std::nullopt;
  if (poses.size() < 2)
    return fail(Error::Kind::Malformed,
                "--exposure and --readout need a camera that moves: give at least two poses with times");
  std::vector<render::Moment> moments;
  for (const sim::TimedPose& pose : poses) moments.push_back({time_s(pose), pose.ecef_from_camera});
  auto motion = render::CameraMotion::through(std::move(moments));
  if (!motion) return fail(motion);
  return std::optional(std::move(*motion));
}

/// Each layer is a sensor of its name.
std::vector<std::string> sensors_of(const render::Scene& scene) {
  std::vector<std::string> sensors;
  for (const render::Layer& layer : scene.layers()) sensors.push_back(layer.name);
  return sensors;
}

/// One frame, of the motion where there is one.
Result<render::Frame> render_frame(render::Renderer& renderer, const render::Scene& scene, const render::Camera& camera,
                                   const sim::TimedPose& pose, const std::optional<render::CameraMotion>& motion,
                                   const render::Shutter& shutter, const render::RenderOptions& options) {
  if (motion) return renderer.render(scene, camera, motion->from(time_s(pose)), shutter, options);
  return renderer.render(scene, camera, pose.ecef_from_camera, options);
}

/// With frames of a few of the poses, which are written as all will be.
Result<render::FittedQuality> fit_time_budget(const RenderArguments& arguments, const render::RenderOptions& options,
                                              const render::Scene& scene, const render::Camera& camera,
                                              const std::vector<sim::TimedPose>& poses,
                                              const std::optional<render::CameraMotion>& motion,
                                              render::Renderer& renderer) {
  record::ScratchDataset scratch(arguments.folder);
  const auto write = [&](render::Frame frame) { return scratch.add(std::move(frame)); };
  const render::TriedFrames then = arguments.no_output ? render::TriedFrames() : write;
  const auto probes = render::choose_probes(poses.size());
  return render::fit_time_budget(
      probes.size(),
      [&](std::size_t probe, const render::RenderOptions& way) {
        return render::probed(
            render_frame(renderer, scene, camera, poses[probes[probe]], motion, arguments.shutter, way), then);
      },
      options, *arguments.time_budget_ms);
}

/// One frame, for which nothing is kept but its truth: its bands are written to `dataset`, where there is one.
Result<render::Frame> render_in_bands(const RenderArguments& arguments, const render::RenderOptions& options,
                                      const render::Scene& scene, const render::Camera& camera,
                                      const sim::TimedPose& pose, const std::optional<render::CameraMotion>& motion,
                                      int rows, render::Renderer& renderer, record::Dataset* dataset) {
  std::optional<record::BandedFrame> file;
  if (dataset) {
    auto begun = dataset->begin_bands(pose.time_ns, arguments.vehicle, options.off_map == render::OffMap::Mask);
    if (!begun) return fail(begun);
    file.emplace(std::move(*begun));
  }
  const auto sink = [&](const render::Frame& band, int) { return file ? file->add(band) : Result<void>(); };
  auto frame =
      motion ? renderer.render_bands(scene, camera, motion->from(time_s(pose)), arguments.shutter, options, rows, sink)
             : renderer.render_bands(scene, camera, pose.ecef_from_camera, options, rows, sink);
  if (!frame || !file) return frame;
  if (auto ok = dataset->add(std::move(*file), *frame); !ok) return fail(ok);
  return frame;
}

/// Renders all poses, into `dataset` where there is one; in bands of `rows` where they are not 0.
Result<void> render_frames(const RenderArguments& arguments, const render::RenderOptions& options,
                           const render::Scene& scene, const render::Camera& camera,
                           const std::vector<sim::TimedPose>& poses, const std::optional<render::CameraMotion>& motion,
                           int rows, render::Renderer& renderer, std::optional<render::AdaptiveQuality> adaptive,
                           record::Dataset* dataset, record::Overview& overview, Summary& summary) {
  const std::vector<std::string> sensors = sensors_of(scene);
  Progress progress("rendering", "frames", static_cast<std::int64_t>(poses.size()), !arguments.json);
  tile::CellCache::Ticket coming;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const sim::TimedPose& pose = poses[i];
    render::RenderOptions frame_options = adaptive ? adaptive->options(options) : options;
    if (rows == 0 && i + 1 < poses.size())
      coming = renderer.prefetch(scene, camera, poses[i + 1].ecef_from_camera, frame_options);
    frame_options.explain = arguments.explain && !summary.explanation;
    auto frame = rows > 0
                     ? render_in_bands(arguments, frame_options, scene, camera, pose, motion, rows, renderer, dataset)
                     : render_frame(renderer, scene, camera, pose, motion, arguments.shutter, frame_options);
    progress.advance();
    if (!frame && frame.error().kind == Error::Kind::OutsideMap) {
      ++summary.rejected;
      if (!dataset) continue;
      if (auto ok = dataset->add_rejected(sensors, pose.time_ns, arguments.vehicle, frame.error().message); !ok)
        return ok;
      continue;
    }
    if (!frame) return fail(frame.error().kind, fmt::format("frame at {} ns: {}", pose.time_ns, advice(frame.error())));
    ++summary.frames;
    summary.in_bands += rows > 0;
    if (is_blank(*frame)) ++summary.blank;
    bool damaged = false, coarse = false;
    for (const render::FrameLayer& layer : frame->layers()) {
      coarse = coarse || (layer.truth.coarse && layer.truth.coarse->fraction > 0);
      damaged = damaged || !layer.truth.damage.empty();
      summary.damage.insert(layer.truth.damage.begin(), layer.truth.damage.end());
    }
    summary.damaged += damaged;
    summary.coarse += coarse;
    summary.times.push_back(frame->counters().times);
    if (adaptive) adaptive->note(frame->truth().render_ms);
    if (frame_options.explain) summary.explanation = frame->explanation();
    if (!arguments.no_pictures && dataset) overview.add(frame->truth(), pose.time_ns);
    if (!dataset || rows > 0) continue;
    std::optional<render::TruthPlanes> planes;
    if (arguments.truth_planes)
      planes = render::truth_planes(
          motion ? render::ExactChain(camera, motion->from(time_s(pose)), arguments.shutter, scene.surface())
                 : render::ExactChain(camera, pose.ecef_from_camera, scene.surface()),
          arguments.threads);
    if (auto ok = dataset->add(std::move(*frame), pose.time_ns, arguments.vehicle,
                               options.off_map == render::OffMap::Mask, std::move(planes));
        !ok)
      return ok;
  }
  return {};
}

Result<void> write_pictures(const record::Overview& overview, render::Renderer& renderer,
                            const std::filesystem::path& folder) {
  for (const render::Layer& layer : overview.scene().layers()) {
    if (auto ok = overview.write_contact_sheet(renderer, layer, folder / fmt::format("contact_{}.png", layer.name));
        !ok)
      return ok;
    if (auto ok = overview.write_footprints(renderer, layer, folder / fmt::format("footprints_{}.png", layer.name));
        !ok)
      return ok;
  }
  return {};
}

Result<void> run(const RenderArguments& arguments) {
  if (arguments.folder.empty() && !arguments.no_output)
    return fail(Error::Kind::Malformed, "no output folder: give -o FOLDER, or --no-output to render and measure only");
  if (arguments.time_budget_ms)
    if (auto ok = render::check_time_budget(*arguments.time_budget_ms); !ok) return ok;
  auto options = make_render_options(arguments);
  if (!options) return fail(options);
  const auto renderer_options = make_renderer_options(arguments);
  if (!renderer_options) return fail(renderer_options);
  const auto mount = make_mount(arguments);
  if (!mount) return fail(mount);
  const auto camera = render::Camera::from_yaml(arguments.camera);
  if (!camera) return fail(camera);
  if (auto ok = check_names_a_file(arguments.camera + ": camera_name", camera->name()); !ok) return ok;
  if (auto ok = check_names_a_file("--vehicle", arguments.vehicle); !ok) return ok;
  const auto scene = make_scene(arguments);
  if (!scene) return fail(scene);
  auto poses = sim::read_pose_file(arguments.poses, scene->surface(), *mount);
  if (!poses) return fail(poses);
  const auto rows = band_rows(arguments, *scene, *camera);
  if (!rows) return fail(rows);
  const auto motion = motion_of(*poses, arguments.shutter);
  if (!motion) return fail(motion);
  if (arguments.first_frames > 0) poses->resize(std::min(poses->size(), arguments.first_frames));

  std::optional<record::Dataset> dataset;
  if (!arguments.no_output) {
    auto created = record::Dataset::create(arguments.folder, arguments.force);
    if (!created) return fail(created);
    dataset.emplace(std::move(*created));
    if (auto ok = dataset->add_camera(arguments.vehicle, *camera); !ok) return ok;
  }

  render::Renderer renderer(*renderer_options);
  record::Overview overview(*scene, *camera, poses->size());
  Summary summary;
  std::optional<render::AdaptiveQuality> adaptive;
  if (arguments.time_budget_ms) {
    if (*rows > 0)
      return fail(Error::Kind::Unsupported,
                  "--time-budget: frames of this size are made in bands, which keep no time: raise --frame-memory to "
                  "what a whole one takes");
    const auto fitted = fit_time_budget(arguments, *options, *scene, *camera, *poses, *motion, renderer);
    if (!fitted) return fail(fitted.error().kind, advice(fitted.error()));
    summary.time_budget =
        record::time_budget_record(arguments.vehicle, sensors_of(*scene), arguments.adaptive, *fitted);
    summary.budget_ms = fitted->budget_ms;
    if (dataset)
      if (auto ok = dataset->write_time_budgets({summary.time_budget}); !ok) return ok;
    tell_time_budget("nadir render", *fitted, arguments.adaptive, arguments.json);
    *options = fitted->options;
    if (arguments.adaptive) adaptive.emplace(*fitted);
  }
  const auto start = std::chrono::steady_clock::now();
  auto rendered = render_frames(arguments, *options, *scene, *camera, *poses, *motion, *rows, renderer, adaptive,
                                dataset ? &*dataset : nullptr, overview, summary);
  // Where rendering failed too: the frames before are whole, and are listed
  if (dataset)
    if (auto ok = dataset->finish(); !ok && rendered) rendered = ok;
  if (!rendered) return rendered;
  summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const bool pictures = dataset && !arguments.no_pictures && summary.frames > 0;
  if (pictures)
    if (auto ok = write_pictures(overview, renderer, arguments.folder); !ok) return ok;

  if (arguments.json) {
    print_json(summary, renderer, arguments.folder);
  } else {
    if (summary.explanation) print_explanation(*summary.explanation);
    if (summary.times.size() > 1 && arguments.explain)
      fmt::print("all frames, in the median, {}\n", render::to_text(summary.median()));
    print_text(summary, arguments.folder, pictures);
  }
  if (summary.frames == 0)
    return fail(Error::Kind::OutsideMap,
                fmt::format("no frame was made: all look beyond the map; {}; `--off-map mask` renders what there is",
                            whereabouts(*scene, poses->front())));
  if (summary.blank == summary.frames && summary.damaged == 0)
    fmt::print(
        stderr,
        "nadir render: note: no frame shows any of a map; {}; check the poses, and that the map holds data there\n",
        whereabouts(*scene, poses->front()));
  return report_damage(summary.damaged, summary.damage);
}

}  // namespace
}  // namespace nadir::app

int main(int argc, char** argv) {
  CLI::App app("Camera frames of maps, with ground truth, for given poses.", "nadir render");
  nadir::app::RenderArguments arguments;
  nadir::app::add_render_options(app, arguments);
  return nadir::app::run_command(app, argc, argv, [&] { return nadir::app::run(arguments); });
}
