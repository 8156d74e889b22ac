// Frames in bands of rows: all that a whole frame decides is decided by planning all bands, then each is sampled alone.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "engine.h"
#include "explain.h"
#include "exposure.h"
#include "frame_layers.h"
#include "pass.h"
#include "render_checks.h"
#include "shared_mappings.h"
#include "stage_timer.h"

namespace nadir::render {
namespace {

/// How one layer of a whole frame is sampled at one instant.
struct Survey {
  SampledPlan planned;  // without blocks
  double geometry_error_px = 0;
  std::vector<tile::CellKey> cells;
};

std::vector<RowRange> bands_of(int height, int band_rows) {
  std::vector<RowRange> bands;
  for (int first = 0; first < height; first += std::min(band_rows, height - first))
    bands.push_back({first, first + std::min(band_rows, height - first)});
  return bands;
}

/// Plans layer `k` of `which` band by band, keeping of each what the whole frame hangs on.
Survey survey(const Scene& scene, const ExactChain& chain, std::span<const std::size_t> which, std::size_t k,
              const Sampling& sampling, double tolerance_px, std::span<const RowRange> bands, ErrorModel& model) {
  const Layer& layer = scene.layers()[which[k]];
  Survey found;
  found.planned.sampling = sampling;
  LayerPlan& sum = found.planned.plan;
  Forecast forecast;
  for (const RowRange& rows : bands) {
    const SharedMappings shared = share_mappings(scene, chain, tolerance_px, which, rows);
    const LayerPlan plan = plan_layer(shared.of(k), *layer.source, sampling, rows);
    found.geometry_error_px = std::max(found.geometry_error_px, shared.of(k).error_px);
    if (plan.blocks.empty()) continue;
    sum.finest_level = found.planned.sees_map ? std::min(sum.finest_level, plan.finest_level) : plan.finest_level;
    sum.coarsest_level = std::max(sum.coarsest_level, plan.coarsest_level);
    sum.undersampled = sum.undersampled || plan.undersampled;
    found.planned.sees_map = true;
    add_cells(plan, found.cells);
    if (is_predicted(layer, sampling)) forecast.add(plan, rows);
  }
  found.planned.expected_rmse = expected_error(layer, forecast, model);
  return found;
}

/// Decides how the layers in `which` are sampled at one instant, and notes it.
Result<void> decide(const Scene& scene, const ExactChain& chain, std::span<const std::size_t> which,
                    const RenderOptions& options, std::span<const RowRange> bands, bool first, ErrorModel& model,
                    std::vector<Sampling>& sampling, std::span<Truth* const> truths) {
  for (std::size_t k = 0; k < which.size(); ++k) {
    Survey last;
    const auto planned = choose_plan(scene.layers()[which[k]], options, [&](const Sampling& way) {
      last = survey(scene, chain, which, k, way, options.geometry_tolerance_px, bands, model);
      return last.planned;
    });
    if (!planned) return fail(planned);
    sampling[which[k]] = planned->sampling;
    note_plan(*planned, last.geometry_error_px, static_cast<std::int64_t>(last.cells.size()), options, first,
              *truths[which[k]]);
  }
  return {};
}

}  // namespace

Result<Frame> Renderer::render_bands(const Scene& scene, const Camera& camera, const CameraPose& ecef_from_camera,
                                     const RenderOptions& options, int band_rows, const BandSink& sink) {
  const auto pose = checked_pose(ecef_from_camera);
  if (!pose) return fail(pose);
  const ExactChain chain(camera, *pose, scene.surface());
  return expose_in_bands(scene, chain, std::span(&chain, 1), options, band_rows, sink);
}

Result<Frame> Renderer::render_bands(const Scene& scene, const Camera& camera, const CameraMotion& motion,
                                     const Shutter& shutter, const RenderOptions& options, int band_rows,
                                     const BandSink& sink) {
  if (auto ok = check(shutter); !ok) return fail(ok);
  if (auto ok = check(options); !ok) return fail(ok);
  if (shutter.instant()) return render_bands(scene, camera, motion.at(0), options, band_rows, sink);
  const auto moving = moving_exposure(camera, motion, shutter, scene.surface(), options.motion_step_px);
  if (!moving) return fail(moving);
  auto frame = expose_in_bands(scene, moving->middle, moving->instants, options, band_rows, sink);
  if (!frame) return frame;
  for (FrameLayer& layer : frame->layers_) layer.truth.exposure = moving->exposure;
  return frame;
}

Result<Frame> Renderer::expose_in_bands(const Scene& scene, const ExactChain& middle,
                                        std::span<const ExactChain> instants, const RenderOptions& options,
                                        int band_rows, const BandSink& sink) {
  using Clock = std::chrono::steady_clock;
  auto start = Clock::now();
  if (auto ok = scene.check(); !ok) return fail(ok);
  if (auto ok = check(options); !ok) return fail(ok);
  if (band_rows < 1)
    return fail(Error::Kind::Malformed, fmt::format("bands: expected at least one row each, found {}", band_rows));
  if (options.allow_coarse)
    return fail(Error::Kind::Unsupported,
                "a frame in bands is no live picture, and waits for its map tiles: do not allow coarser levels for it");
  const WorkTotals before = work_so_far(scene, engine_->cache);
  const int height = middle.camera().height_px();
  const std::vector<RowRange> bands = bands_of(height, band_rows);

  Frame frame;
  const LayerKinds kinds = kinds_of(scene);
  for (const Layer& layer : scene.layers()) {
    FrameLayer out = empty_layer(layer, middle, engine_->frames);
    if (options.off_map == OffMap::Reject)
      if (auto ok = refuse_off_map(layer, out.truth); !ok) return fail(ok);
    frame.layers_.push_back(std::move(out));
  }
  std::vector<Truth*> truths;
  for (FrameLayer& layer : frame.layers_) truths.push_back(&layer.truth);
  std::vector<std::vector<Sampling>> sampling(instants.size(), std::vector<Sampling>(kinds.all.size()));
  const auto decided = [&](const ExactChain& chain, std::span<const std::size_t> which, std::size_t instant) {
    return decide(scene, chain, which, options, bands, instant == 0, engine_->error_model, sampling[instant], truths);
  };
  if (instants.size() == 1) {
    if (auto ok = decided(instants[0], kinds.all, 0); !ok) return fail(ok);
  } else {
    if (auto ok = decided(middle, kinds.labels, 0); !ok) return fail(ok);
    for (std::size_t k = 0; k < instants.size(); ++k)
      if (auto ok = decided(instants[k], kinds.blended, k); !ok) return fail(ok);
  }

  std::set<std::string> damage;
  std::vector<std::int64_t> valid(kinds.all.size(), 0);
  double& render_ms = frame.counters_.times.whole_ms;
  for (const RowRange& rows : bands) {
    for (const std::size_t i : kinds.all) allocate(scene.layers()[i], rows.end - rows.first, frame.layers_[i]);
    const Band band{rows, sampling};
    if (auto ok = expose_rows(scene, middle, instants, options, &band, frame, damage); !ok) return fail(ok);
    const auto finish = [&] {
      for (const std::size_t i : kinds.all) valid[i] += finish_layer(scene.layers()[i], options, frame.layers_[i]);
    };
    timed(frame.counters_.times.finishing_ms, [&] { engine_->arena.execute(finish); });
    render_ms += std::chrono::duration<double, std::milli>(Clock::now() - start).count();
    if (auto ok = sink(frame, rows.first); !ok) return fail(ok);
    start = Clock::now();  // what the sink does is not the renderer's
  }

  count_work(before, work_so_far(scene, engine_->cache), frame.counters_);
  for (const std::size_t i : kinds.all) {
    FrameLayer& out = frame.layers_[i];
    out.height = height;
    out.samples = {};
    out.validity = {};
    out.truth.valid_fraction =
        static_cast<double>(valid[i]) / (static_cast<double>(out.width) * static_cast<double>(height));
    out.truth.render_ms = render_ms;
    frame.counters_.cells += out.truth.tiles;
    note_damage(damage, out.truth);
  }
  if (options.explain) {
    frame.explanation_.bands = static_cast<std::int64_t>(bands.size());
    frame.explanation_.band_rows = bands.front().end;
    finish_explanation(scene, middle.camera(), frame.counters_, frame.explanation_);
  }
  return frame;
}

}  // namespace nadir::render
