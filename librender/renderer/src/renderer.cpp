#include "nadir/render/renderer.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "engine.h"
#include "explain.h"
#include "exposure.h"
#include "frame_layers.h"
#include "nadir/base/text.h"
#include "pass.h"
#include "render_checks.h"
#include "sampling_choice.h"
#include "shared_mappings.h"
#include "stage_timer.h"

namespace nadir::render {
namespace {

constexpr std::array<std::string_view, 3> off_map_names = {"mask", "fill", "reject"};

void note_coarse(const CoarseFill& fill, Truth& truth) {
  const CoarseFill before = truth.coarse.value_or(CoarseFill{});
  truth.coarse = CoarseFill{std::max(before.fraction, fill.fraction), std::max(before.levels, fill.levels)};
}

}  // namespace

std::string_view to_string(OffMap off_map) { return off_map_names[static_cast<std::size_t>(off_map)]; }

Result<OffMap> parse_off_map(std::string_view text) { return parse_name<OffMap>("off-map rule", text, off_map_names); }

Renderer::Renderer(const RendererOptions& options) : engine_(std::make_unique<Engine>(options)) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

tile::CacheCounters Renderer::cache_counters() const { return engine_->cache.counters(); }
FrameMemoryCounters Renderer::frame_memory_counters() const { return engine_->frames->counters(); }
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
  const auto moving = moving_exposure(camera, motion, shutter, scene.surface(), options.motion_step_px);
  if (!moving) return fail(moving);
  const Exposure& exposure = moving->exposure;
  auto frame = expose(scene, moving->middle, moving->instants, options);
  if (!frame) return frame;
  for (FrameLayer& layer : frame->layers_) layer.truth.exposure = exposure;
  if (options.explain) frame->explanation_.exposure = exposure;
  return frame;
}

Result<Frame> Renderer::expose(const Scene& scene, const ExactChain& middle, std::span<const ExactChain> instants,
                               const RenderOptions& options) {
  Frame frame;
  StageTimes& times = frame.counters_.times;
  std::optional<StageTimer> whole(times.whole_ms), preparing(times.preparing_ms);
  if (auto ok = scene.check(); !ok) return fail(ok);
  if (auto ok = check(options); !ok) return fail(ok);
  const WorkTotals before = work_so_far(scene, engine_->cache);

  for (const Layer& layer : scene.layers()) {
    FrameLayer out = empty_layer(layer, middle, engine_->frames);
    if (options.off_map == OffMap::Reject)
      if (auto ok = refuse_off_map(layer, out.truth); !ok) return fail(ok);
    allocate(layer, out.height, out);
    frame.layers_.push_back(std::move(out));
  }
  preparing.reset();
  std::set<std::string> damage;
  if (auto ok = expose_rows(scene, middle, instants, options, nullptr, frame, damage); !ok) return fail(ok);

  count_work(before, work_so_far(scene, engine_->cache), frame.counters_);
  for (std::size_t i = 0; i < frame.layers_.size(); ++i) {
    FrameLayer& out = frame.layers_[i];
    const std::int64_t valid = timed(times.finishing_ms, [&] {
      return engine_->arena.execute([&] { return finish_layer(scene.layers()[i], options, out); });
    });
    out.truth.valid_fraction = static_cast<double>(valid) / static_cast<double>(out.validity.size());
    frame.counters_.cells += out.truth.tiles;
    note_damage(damage, out.truth);
  }
  whole.reset();
  for (FrameLayer& layer : frame.layers_) layer.truth.render_ms = times.whole_ms;
  if (options.explain) finish_explanation(scene, middle.camera(), frame.counters_, frame.explanation_);
  return frame;
}

Result<void> Renderer::expose_rows(const Scene& scene, const ExactChain& middle, std::span<const ExactChain> instants,
                                   const RenderOptions& options, const Band* band, Frame& frame,
                                   std::set<std::string>& damage) {
  const LayerKinds kinds = kinds_of(scene);
  if (instants.size() == 1) return sample(scene, instants[0], kinds.all, options, 0, band, frame, damage);
  if (!kinds.labels.empty())
    if (auto ok = sample(scene, middle, kinds.labels, options, 0, band, frame, damage); !ok) return ok;
  std::vector<MeanImage> means;
  for (const std::size_t i : kinds.blended)
    means.emplace_back(frame.layers_[i], scene.layers()[i].source->domain() == tile::Domain::Decibel);
  for (std::size_t k = 0; k < instants.size() && !kinds.blended.empty(); ++k) {
    if (auto ok = sample(scene, instants[k], kinds.blended, options, k, band, frame, damage); !ok) return ok;
    const StageTimer finishing(frame.counters_.times.finishing_ms);
    engine_->arena.execute([&] {
      for (std::size_t m = 0; m < means.size(); ++m) means[m].add(frame.layers_[kinds.blended[m]]);
    });
  }
  const StageTimer finishing(frame.counters_.times.finishing_ms);
  engine_->arena.execute([&] {
    for (std::size_t m = 0; m < means.size(); ++m) means[m].write(frame.layers_[kinds.blended[m]]);
  });
  return {};
}

Result<LayerPlan> Renderer::plan_whole(const Layer& layer, const PatchMapping& mapping, const RenderOptions& options,
                                       bool first, FrameLayer& out, std::vector<tile::CellPtr>& held) {
  auto planned = plan_sampling(layer, mapping, options, engine_->error_model);
  if (!planned) return fail(planned);
  if (options.allow_coarse) {
    MemoryPlan there;
    if (may_be_coarse(layer))
      there = sample_from_memory(layer, static_cast<double>(out.validity.size()), first, engine_->cache,
                                 engine_->missing, planned->plan);
    note_coarse(there.fill, out.truth);
    if (there.fill.levels > 0) {
      Forecast forecast;
      if (is_predicted(layer, planned->sampling)) forecast.add(planned->plan);
      planned->expected_rmse = expected_error(layer, forecast, engine_->error_model);
    }
    held.insert(held.end(), there.held.begin(), there.held.end());
  }
  std::vector<tile::CellKey> cells;
  add_cells(planned->plan, cells);
  note_plan(*planned, mapping.error_px, static_cast<std::int64_t>(cells.size()), options, first, out.truth);
  return std::move(planned->plan);
}

Result<void> Renderer::sample(const Scene& scene, const ExactChain& chain, std::span<const std::size_t> which,
                              const RenderOptions& options, std::size_t instant, const Band* band, Frame& frame,
                              std::set<std::string>& damage) {
  const RowRange rows = band ? band->rows : RowRange{};
  const bool first = instant == 0, explained = first && options.explain && rows.first == 0;
  StageTimes& times = frame.counters_.times;
  const SharedMappings shared =
      timed(times.mapping_ms, [&] { return share_mappings(scene, chain, options.geometry_tolerance_px, which, rows); });
  for (const PatchMapping& mapping : shared.mappings) frame.counters_.exact_points += mapping.exact_points;

  std::optional<StageTimer> planning(times.planning_ms);
  std::vector<LayerPlan> plans;
  std::vector<tile::CellPtr> held;
  for (std::size_t k = 0; k < which.size(); ++k) {
    const Layer& layer = scene.layers()[which[k]];
    if (band) {
      plans.push_back(plan_layer(shared.of(k), *layer.source, band->sampling[instant][which[k]], rows));
    } else {
      auto plan = plan_whole(layer, shared.of(k), options, first, frame.layers_[which[k]], held);
      if (!plan) return fail(plan);
      plans.push_back(std::move(*plan));
    }
    frame.counters_.samples += plans.back().samples;
  }
  std::vector<std::vector<WorkItem>> of_layers(plans.size());
  for (std::size_t k = 0; k < plans.size(); ++k) {
    FrameLayer& out = frame.layers_[which[k]];
    prepare(plans[k], out);
    for (const PlannedBlock& block : plans[k].blocks)
      of_layers[k].push_back({&block, scene.layers()[which[k]].source.get(), out.samples.data(), out.validity.data(),
                              static_cast<std::size_t>(out.width), rows});
  }
  const std::vector<WorkItem> items = in_groups(of_layers);
  planning.reset();

  const auto take = [&] {
    return engine_->arena.execute([&] { return run_passes(items, engine_->cache, frame.counters_, damage); });
  };
  auto sampled = take();
  if (!sampled && sampled.error().kind == Error::Kind::OverBudget && !held.empty()) {
    held.clear();  // what is held leaves too little room for the coarsest level: in passes, and waiting where it must
    sampled = take();
  }
  if (!sampled) return sampled;
  for (std::size_t k = 0; explained && k < plans.size(); ++k)
    frame.explanation_.layers.push_back(explain_layer(scene.layers()[which[k]], shared.of(k), !shared.is_first(k),
                                                      plans[k], frame.layers_[which[k]].truth));
  return {};
}

}  // namespace nadir::render
