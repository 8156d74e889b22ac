#include "nadir/render/renderer.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>

#include "explain.h"
#include "exposure.h"
#include "nadir/base/text.h"
#include "pass.h"
#include "render_checks.h"
#include "sampling_choice.h"
#include "shared_mappings.h"

namespace nadir::render {
namespace {

constexpr std::array<std::string_view, 3> off_map_names = {"mask", "fill", "reject"};

struct WorkTotals {
  std::int64_t projection_points = 0, windows_read = 0, samples_read = 0;
};

/// Of all maps of a scene, each counted once however many layers it has.
WorkTotals totals(const Scene& scene) {
  WorkTotals t;
  std::vector<const tile::MapDescription*> seen;
  for (const Layer& layer : scene.layers()) {
    const tile::Map& map = layer.source->map();
    if (std::find(seen.begin(), seen.end(), &map.description()) != seen.end()) continue;
    seen.push_back(&map.description());
    t.projection_points += map.projection().library_points();
    t.windows_read += map.counters().windows_read;
    t.samples_read += map.counters().samples_read;
  }
  return t;
}

/// What invalid pixels hold.
void finish_invalid(FrameLayer& layer, const RenderOptions& options) {
  const bool fill = options.off_map == OffMap::Fill;
  tile::with_sample_type(layer.type, [&]<class T>(T) {
    T value{};
    if constexpr (std::is_floating_point_v<T>)
      value = fill ? static_cast<T>(options.fill_value) : std::numeric_limits<T>::quiet_NaN();
    else if (fill)
      value = static_cast<T>(
          std::clamp<double>(options.fill_value, std::numeric_limits<T>::min(), std::numeric_limits<T>::max()));
    T* samples = reinterpret_cast<T*>(layer.samples.data());
    const auto bands = static_cast<std::size_t>(layer.bands);
    for (std::size_t i = 0; i < layer.validity.size(); ++i)
      if (!layer.validity[i]) std::fill_n(samples + i * bands, bands, value);
  });
}

/// A layer of the frame with its geometric truth, but no pixels yet.
FrameLayer empty_layer(const Layer& layer, const ExactChain& chain) {
  FrameLayer out;
  out.name = layer.name;
  out.width = chain.camera().width_px();
  out.height = chain.camera().height_px();
  out.bands = static_cast<int>(layer.source->bands().size());
  out.type = layer.source->type();
  out.truth = geometric_truth(chain, layer.source->map());
  return out;
}

/// Of the instants of an exposure, the widest range of levels, and the most of all else.
void note_plan(const LayerPlan& plan, const PatchMapping& mapping, const Sampling& sampling,
               const RenderOptions& options, bool first, Truth& truth) {
  truth.quality = options.quality;
  truth.filter = sampling.filter;
  truth.oversampling = sampling.oversampling;
  truth.adaptive = options.adaptive;
  truth.finest_level = first ? plan.finest_level : std::min(truth.finest_level, plan.finest_level);
  truth.coarsest_level = std::max(truth.coarsest_level, plan.coarsest_level);
  truth.undersampled = truth.undersampled || plan.undersampled;
  truth.geometry_error_px = std::max(truth.geometry_error_px, mapping.error_px);
  truth.tiles = std::max(truth.tiles, count_cells(plan));
}

void clear(FrameLayer& layer) {
  std::fill(layer.samples.begin(), layer.samples.end(), std::byte{0});
  std::fill(layer.validity.begin(), layer.validity.end(), std::uint8_t{0});
}

/// From map values to what the sensor delivers.
void finish_layer(const Layer& layer, const RenderOptions& options, FrameLayer& out) {
  const std::size_t pixels = out.validity.size();
  if (const auto& output = layer.options.output) {
    out.samples = convert(out.samples.data(), out.type, pixels * static_cast<std::size_t>(out.bands), *output);
    out.type = output->type;
  }
  const auto valid = static_cast<std::size_t>(std::count(out.validity.begin(), out.validity.end(), 1));
  if (valid < pixels) finish_invalid(out, options);
  out.truth.valid_fraction = static_cast<double>(valid) / static_cast<double>(pixels);
}

}  // namespace

std::string_view to_string(OffMap off_map) { return off_map_names[static_cast<std::size_t>(off_map)]; }

Result<OffMap> parse_off_map(std::string_view text) { return parse_name<OffMap>("off-map rule", text, off_map_names); }

/// GDAL keeps decoded blocks of its own: an eighth of the budget, so that neighbouring cells do not decode a block
/// twice.
struct Renderer::Engine {
  explicit Engine(const RendererOptions& options)
      : cache(options.cache_bytes - options.cache_bytes / 8, options.threads),
        arena(options.threads > 0 ? options.threads : tbb::task_arena::automatic) {
    tile::limit_gdal_block_cache(options.cache_bytes / 8);
  }
  tile::CellCache cache;
  tbb::task_arena arena;
  ErrorModel error_model;
};

Renderer::Renderer(const RendererOptions& options) : engine_(std::make_unique<Engine>(options)) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

tile::CacheCounters Renderer::cache_counters() const { return engine_->cache.counters(); }
tile::CellCache& Renderer::cache() { return engine_->cache; }

tile::CellCache::Ticket Renderer::prefetch(const Scene& scene, const Camera& camera, const CameraPose& ecef_from_camera,
                                           const RenderOptions& options) {
  const auto pose = checked_pose(ecef_from_camera);
  if (!scene.check() || !check(options) || !pose) return {};
  const ExactChain chain(camera, *pose, scene.surface());
  std::vector<std::size_t> all(scene.layers().size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  constexpr double tolerance_px = 1;  // cells are large
  const SharedMappings shared = share_mappings(scene, chain, tolerance_px, all);
  std::vector<LayerPlan> plans;
  for (const std::size_t i : all)
    plans.push_back(plan_layer(shared.of(i), *scene.layers()[i].source, sampling_of(scene.layers()[i], options)));
  std::vector<WorkItem> items;
  for (const std::size_t i : all)
    for (const PlannedBlock& block : plans[i].blocks) items.push_back({&block, scene.layers()[i].source.get()});
  return engine_->cache.prefetch(wanted_cells(items));
}

Result<Frame> Renderer::render(const Scene& scene, const Camera& camera, const CameraPose& ecef_from_camera,
                               const RenderOptions& options) {
  const auto pose = checked_pose(ecef_from_camera);
  if (!pose) return fail(pose);
  const ExactChain chain(camera, *pose, scene.surface());
  return expose(scene, chain, std::span(&chain, 1), options);
}

Result<Frame> Renderer::render(const Scene& scene, const Camera& camera, const CameraMotion& motion,
                               const Shutter& shutter, const RenderOptions& options) {
  if (auto ok = check(shutter); !ok) return fail(ok);
  if (auto ok = check(options); !ok) return fail(ok);
  if (shutter.instant()) return render(scene, camera, motion.at(0), options);
  Exposure exposure{.shutter = shutter};
  exposure.motion_px = motion_px(camera, motion, shutter, scene.surface());
  const auto instants_s = exposure_instants_s(shutter, exposure.motion_px, options.motion_step_px);
  if (!instants_s) return fail(instants_s);
  exposure.poses = static_cast<int>(instants_s->size());
  const double half_s = (shutter.exposure_s + shutter.readout_s) / 2;
  exposure.ecef_from_camera_at_start = motion.at(-half_s);
  exposure.ecef_from_camera_at_end = motion.at(half_s);

  std::vector<ExactChain> chains;
  for (const double of_exposure_s : *instants_s)
    chains.emplace_back(camera, motion, shutter, scene.surface(), of_exposure_s);
  auto frame = expose(scene, {camera, motion, shutter, scene.surface()}, chains, options);
  if (!frame) return frame;
  for (FrameLayer& layer : frame->layers_) layer.truth.exposure = exposure;
  if (options.explain)
    frame->explanation_.done.push_back(
        fmt::format("exposure: {} poses over {} s, in which what is seen goes {:.2f} px; readout {} s", exposure.poses,
                    shutter.exposure_s, exposure.motion_px, shutter.readout_s));
  return frame;
}

Result<Frame> Renderer::expose(const Scene& scene, const ExactChain& middle, std::span<const ExactChain> instants,
                               const RenderOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  if (auto ok = scene.check(); !ok) return fail(ok);
  if (auto ok = check(options); !ok) return fail(ok);
  const WorkTotals before = totals(scene);
  const tile::CacheCounters cache_before = engine_->cache.counters();

  Frame frame;
  const std::size_t pixels =
      static_cast<std::size_t>(middle.camera().width_px()) * static_cast<std::size_t>(middle.camera().height_px());
  std::vector<std::size_t> all, blended, unblended;
  for (const Layer& layer : scene.layers()) {
    FrameLayer out = empty_layer(layer, middle);
    if (options.off_map == OffMap::Reject)
      if (auto ok = refuse_off_map(layer, out.truth); !ok) return fail(ok);
    out.samples.resize(pixels * static_cast<std::size_t>(out.bands) * tile::size_bytes(out.type));
    out.validity.resize(pixels);
    (layer.options.role == tile::Role::Labels ? unblended : blended).push_back(all.size());
    all.push_back(all.size());
    frame.layers_.push_back(std::move(out));
  }
  std::set<std::string> damage;
  if (instants.size() == 1) {
    if (auto ok = sample(scene, instants[0], all, options, true, frame, damage); !ok) return fail(ok);
  } else {
    if (!unblended.empty())
      if (auto ok = sample(scene, middle, unblended, options, true, frame, damage); !ok) return fail(ok);
    std::vector<MeanImage> means;
    for (const std::size_t i : blended)
      means.emplace_back(frame.layers_[i], scene.layers()[i].source->domain() == tile::Domain::Decibel);
    for (std::size_t k = 0; k < instants.size() && !blended.empty(); ++k) {
      if (k > 0)
        for (const std::size_t i : blended) clear(frame.layers_[i]);
      if (auto ok = sample(scene, instants[k], blended, options, k == 0, frame, damage); !ok) return fail(ok);
      engine_->arena.execute([&] {
        for (std::size_t m = 0; m < means.size(); ++m) means[m].add(frame.layers_[blended[m]]);
      });
    }
    engine_->arena.execute([&] {
      for (std::size_t m = 0; m < means.size(); ++m) means[m].write(frame.layers_[blended[m]]);
    });
  }

  const WorkTotals after = totals(scene);
  frame.counters_.projection_points = after.projection_points - before.projection_points;
  frame.counters_.windows_read = after.windows_read - before.windows_read;
  frame.counters_.samples_read = after.samples_read - before.samples_read;
  frame.counters_.cells_loaded = engine_->cache.counters().loads - cache_before.loads;
  for (std::size_t i = 0; i < frame.layers_.size(); ++i) {
    FrameLayer& out = frame.layers_[i];
    finish_layer(scene.layers()[i], options, out);
    frame.counters_.cells += out.truth.tiles;
    for (const std::string& message : damage)
      if (message.starts_with(out.truth.map_path)) out.truth.damage.push_back(message);
  }
  if (options.explain) explain_frame(scene, middle.camera(), frame.counters_, frame.explanation_);
  const double render_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  for (FrameLayer& layer : frame.layers_) layer.truth.render_ms = render_ms;
  return frame;
}

Result<void> Renderer::sample(const Scene& scene, const ExactChain& chain, std::span<const std::size_t> which,
                              const RenderOptions& options, bool first, Frame& frame, std::set<std::string>& damage) {
  const SharedMappings shared = share_mappings(scene, chain, options.geometry_tolerance_px, which);
  for (const PatchMapping& mapping : shared.mappings) frame.counters_.exact_points += mapping.exact_points;

  std::vector<LayerPlan> plans;
  for (std::size_t k = 0; k < which.size(); ++k) {
    const Layer& layer = scene.layers()[which[k]];
    Truth& truth = frame.layers_[which[k]].truth;
    auto planned = plan_sampling(layer, shared.of(k), options, engine_->error_model);
    if (!planned) return fail(planned);
    note_plan(planned->plan, shared.of(k), planned->sampling, options, first, truth);
    truth.expected_rmse = planned->expected_rmse;
    plans.push_back(std::move(planned->plan));
    frame.counters_.samples += plans.back().samples;
  }
  std::vector<WorkItem> items;
  for (std::size_t k = 0; k < plans.size(); ++k) {
    FrameLayer& out = frame.layers_[which[k]];
    for (const PlannedBlock& block : plans[k].blocks)
      items.push_back({&block, scene.layers()[which[k]].source.get(), out.samples.data(), out.validity.data(),
                       static_cast<std::size_t>(out.width)});
  }

  const auto sampled =
      engine_->arena.execute([&] { return run_passes(items, engine_->cache, frame.counters_, damage); });
  if (!sampled) return sampled;
  for (std::size_t k = 0; first && options.explain && k < plans.size(); ++k)
    explain_layer(scene.layers()[which[k]], shared.of(k), !shared.is_first(k), plans[k], frame.layers_[which[k]],
                  frame.explanation_);
  return {};
}

}  // namespace nadir::render
