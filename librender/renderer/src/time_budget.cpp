#include "nadir/render/time_budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace nadir::render {
namespace {

/// The median of a few renderings of what was rendered before.
Result<double> median_ms(std::size_t probe, const RenderProbe& render_probe, const RenderOptions& options) {
  std::array<double, 3> ms{};
  for (double& one : ms) {
    const auto frame = render_probe(probe, options);
    if (!frame) return fail(frame);
    one = frame->ms;
  }
  std::sort(ms.begin(), ms.end());
  return ms[ms.size() / 2];
}

}  // namespace

std::optional<double> FittedQuality::expected_ms() const {
  if (measured_ms.empty()) return std::nullopt;
  return measured_ms[rung];
}

bool FittedQuality::fits() const { return !measured_ms.empty() && measured_ms[rung] <= budget_ms; }

std::string to_string(const FittedQuality& fitted) {
  const auto ladder = quality_ladder();
  const std::string budget = fmt::format("time budget {} ms: ", fitted.budget_ms);
  if (fitted.measured_ms.empty())
    return budget + fmt::format(
                        "{}, the cheapest way of sampling, since no frame tried sees a map and nothing could "
                        "be measured",
                        to_string(ladder[0]));
  const std::string slowest =
      fitted.probes == 1 ? "in the frame tried" : fmt::format("in the slowest of {} frames tried", fitted.probes);
  if (!fitted.fits())
    return budget + fmt::format(
                        "not kept: {}, the cheapest way of sampling, takes {:.2f} ms {}; it is taken; allow "
                        "more time or threads, or render smaller frames",
                        to_string(ladder[0]), fitted.measured_ms[0], slowest);
  std::string text = budget + fmt::format("{}, which takes {:.2f} ms {}", to_string(ladder[fitted.rung]),
                                          fitted.measured_ms[fitted.rung], slowest);
  if (const std::size_t next = fitted.rung + 1; next < fitted.measured_ms.size())
    return text + fmt::format("; {} takes {:.2f} ms", to_string(ladder[next]), fitted.measured_ms[next]);
  return text + "; there is none finer";
}

Result<ProbedFrame> probed(Result<Frame> frame, const TriedFrames& then) {
  if (!frame && frame.error().kind == Error::Kind::OutsideMap) return ProbedFrame{};
  if (!frame) return fail(frame);
  const auto& layers = frame->layers();
  const bool sees_map =
      std::any_of(layers.begin(), layers.end(), [](const FrameLayer& layer) { return layer.truth.valid_fraction > 0; });
  const ProbedFrame result{frame->truth().render_ms, sees_map};
  if (then)
    if (auto ok = then(std::move(*frame)); !ok) return fail(ok);
  return result;
}

Result<void> check_time_budget(double budget_ms) {
  if (budget_ms > 0 && std::isfinite(budget_ms)) return {};
  return fail(Error::Kind::Malformed,
              fmt::format("time budget: expected a positive number of milliseconds a frame, found {}", budget_ms));
}

std::vector<std::size_t> choose_probes(std::size_t count) {
  constexpr std::size_t most = 5;
  std::vector<std::size_t> chosen;
  const std::size_t n = std::min(count, most);
  for (std::size_t i = 0; i < n; ++i) chosen.push_back(n == 1 ? 0 : i * (count - 1) / (n - 1));
  return chosen;
}

Result<FittedQuality> fit_time_budget(std::size_t probes, const RenderProbe& render_probe, const RenderOptions& options,
                                      double budget_ms) {
  if (auto ok = check_time_budget(budget_ms); !ok) return fail(ok);
  if (options.max_error || options.filter || options.oversampling)
    return fail(Error::Kind::Malformed,
                "time budget: it chooses the way of sampling: ask for no filter, no oversampling and no max error");
  FittedQuality fitted{.budget_ms = budget_ms};
  const auto ladder = quality_ladder();

  // Those that see a map, the slowest first: it tells soonest that a way of sampling is over the budget
  std::vector<std::pair<double, std::size_t>> slowest_first;
  for (std::size_t probe = 0; probe < probes; ++probe)
    for (const bool warm : {false, true}) {
      const auto frame = render_probe(probe, with_rung(options, ladder[0]));
      if (!frame) return fail(frame);
      if (!frame->sees_map) break;
      if (warm) slowest_first.emplace_back(frame->ms, probe);
    }
  std::sort(slowest_first.rbegin(), slowest_first.rend());
  fitted.probes = slowest_first.size();

  for (std::size_t rung = 0; rung < ladder.size() && fitted.probes > 0; ++rung) {
    const RenderOptions way = with_rung(options, ladder[rung]);
    double slowest_ms = 0;
    for (const auto& [first_ms, probe] : slowest_first) {
      if (rung > 0)  // reads what this way of sampling needs; the cheapest one's is there
        if (const auto frame = render_probe(probe, way); !frame) return fail(frame);
      const auto ms = median_ms(probe, render_probe, way);
      if (!ms) return fail(ms);
      slowest_ms = std::max(slowest_ms, *ms);
      if (slowest_ms > budget_ms) break;
    }
    fitted.measured_ms.push_back(slowest_ms);
    if (slowest_ms > budget_ms) break;
    fitted.rung = rung;
  }
  fitted.options = with_rung(options, ladder[fitted.rung]);
  return fitted;
}

Result<FittedQuality> fit_time_budget(Renderer& renderer, const Scene& scene, const Camera& camera,
                                      std::span<const CameraPose> poses, const RenderOptions& options,
                                      double budget_ms) {
  const std::vector<std::size_t> probes = choose_probes(poses.size());
  return fit_time_budget(
      probes.size(),
      [&](std::size_t probe, const RenderOptions& way) {
        return probed(renderer.render(scene, camera, poses[probes[probe]], way));
      },
      options, budget_ms);
}

}  // namespace nadir::render
