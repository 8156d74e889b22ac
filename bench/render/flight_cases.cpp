#include "flight_cases.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "contestants.h"
#include "nadir/bench/report.h"
#include "nadir/bench/statistics.h"

namespace nadir::bench {
namespace {

/// Views of a pose moved along, as a file; the setting's own view is the first one.
Result<std::vector<View>> add_flight(const std::shared_ptr<ViewSetting>& setting, const Pose& pose, int frames,
                                     const std::array<double, 2>& step_px) {
  const auto map = tile::Map::open(setting->map);
  if (!map) return fail(map);
  std::vector<View> views;
  for (int i = 0; i < frames; ++i) {
    const double along = i - frames / 2.0;
    auto view = view_of(pose, setting->view.width, setting->view.height, *map, usual_texel_m, step_px[0] * along,
                        step_px[1] * along);
    if (!view) return fail(view);
    views.push_back(std::move(*view));
  }
  setting->views = setting->scratch / fmt::format("flight_{}_{}.views", pose.name, frames);
  if (const auto written = write_views(setting->views, views); !written) return fail(written);
  return views;
}

/// All frames of a flight, one after the other: the mean of a frame. `after`: each frame, not measured.
Result<Usage> fly(PeerProcess& peer, int frames, const std::function<Result<void>(int, const Usage&)>& after) {
  Usage sum;
  for (int i = 0; i < frames; ++i) {
    const auto one = peer.frame(i);
    if (!one) return fail(one);
    sum.wall_ms += one->wall_ms / frames;
    sum.cpu_ms += one->cpu_ms / frames;
    sum.peak_bytes = one->peak_bytes;
    if (const auto done = after(i, *one); !done) return fail(done);
  }
  return sum;
}

using Pixels = std::string;

/// Lanczos weights of the 8 samples around a place `fraction` behind the fourth one.
std::array<double, 8> lanczos(double fraction) {
  std::array<double, 8> weights{};
  double sum = 0;
  for (int i = 0; i < 8; ++i) {
    const double x = std::numbers::pi * (i - 3 - fraction);
    weights[static_cast<std::size_t>(i)] = std::abs(x) < 1e-9 ? 1 : 4 * std::sin(x) * std::sin(x / 4) / (x * x);
    sum += weights[static_cast<std::size_t>(i)];
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

}  // namespace

double squares_of_change(std::span<const std::byte> before, std::span<const std::byte> now, int width, int height,
                         int bands, const std::array<double, 2>& motion_px) {
  // A pixel's content was at its place less the motion
  const double shift_x = -motion_px[0], shift_y = -motion_px[1];
  const int whole_x = static_cast<int>(std::floor(shift_x)), whole_y = static_cast<int>(std::floor(shift_y));
  const auto wx = lanczos(shift_x - whole_x), wy = lanczos(shift_y - whole_y);
  const int border = 5 + std::max(std::abs(whole_x), std::abs(whole_y));
  const auto at = [&](std::span<const std::byte> picture, int x, int y, int band) {
    return static_cast<double>(picture[static_cast<std::size_t>((y * width + x) * bands + band)]);
  };
  std::vector<double> rows(static_cast<std::size_t>(width * height * bands));  // moved along rows
  for (int y = 0; y < height; ++y)
    for (int x = border; x < width - border; ++x)
      for (int band = 0; band < bands; ++band) {
        double sum = 0;
        for (int i = 0; i < 8; ++i) sum += wx[static_cast<std::size_t>(i)] * at(before, x + whole_x + i - 3, y, band);
        rows[static_cast<std::size_t>((y * width + x) * bands + band)] = sum;
      }
  double squares = 0, count = 0;
  for (int y = border; y < height - border; ++y)
    for (int x = border; x < width - border; ++x)
      for (int band = 0; band < bands; ++band) {
        double sum = 0;
        for (int i = 0; i < 8; ++i)
          sum += wy[static_cast<std::size_t>(i)] *
                 rows[static_cast<std::size_t>(((y + whole_y + i - 3) * width + x) * bands + band)];
        const double change = at(now, x, y, band) - sum;
        squares += change * change;
        ++count;
      }
  return squares / count;
}

Case steady_flight(const RunOptions& options) {
  const int width = options.quick ? 160 : 1920, height = options.quick ? 120 : 1080, frames = options.quick ? 20 : 300;
  return {
      fmt::format("steady flight, {} x {}", width, height), [=]() -> Result<Comparison> {
        constexpr double speed_mps = 30, rate_hz = 10;
        const auto scenery = std::make_shared<const Scenery>(options, MapKind{});
        const Pose pose{"flight"};
        auto setting = setting_of(options, scenery, pose, width, height, "zstd", 1);
        if (!setting) return fail(setting);
        const auto views = add_flight(*setting, pose, frames, {0, -speed_mps / rate_hz / usual_texel_m});
        if (!views) return fail(views);
        Comparison comparison{.work = 1, .work_unit = "frames"};
        comparison.warm_up = false;
        comparison.go_on = true;
        comparison.rounds = 1;
        for (const Contestant& contestant : contestants({"nadir draft", "nadir balanced", "GDAL + OpenCV linear"})) {
          Method method{.name = contestant.name, .setting = threads_setting(2)};
          const auto peer = start(**setting, contestant, 2);
          if (!peer) method.left_out = peer.error().message;
          const auto times = std::make_shared<std::vector<double>>();
          if (peer)
            method.told = [=, peer = *peer] {
              return fly(*peer, frames, [&](int, const Usage& usage) -> Result<void> {
                times->push_back(usage.wall_ms);
                return {};
              });
            };
          method.counters = [times]() -> std::map<std::string, std::string> {
            const auto at = [&](double q) { return short_number(quantile(*times, q)); };
            return {{"happened", fmt::format("frame times: median {} ms, 95 % within {}, 99 % within {}, longest {}",
                                             at(0.5), at(0.95), at(0.99), at(1))}};
          };
          comparison.methods.push_back(std::move(method));
        }
        comparison.aims = {{.method = label("nadir draft", threads_setting(2)),
                            .baseline = label("GDAL + OpenCV linear", threads_setting(2))}};
        return comparison;
      }};
}

Case flicker(const RunOptions& options) {
  return {"flicker, zoomed out 3.8 times", [=]() -> Result<Comparison> {
            const int width = options.quick ? 120 : 400, height = options.quick ? 90 : 300;
            const int frames = options.quick ? 4 : 20;
            // No whole number of pixels a frame, so that each frame samples other points of the ground
            constexpr std::array motion_px = {1.84, 1.38};
            const auto scenery = std::make_shared<const Scenery>(options, MapKind{});
            const Pose pose{"flicker", 3.8};
            auto setting = setting_of(options, scenery, pose, width, height, "none", 1);
            if (!setting) return fail(setting);
            // The ground moves right and down in the picture where the camera moves left and up
            const auto views = add_flight(*setting, pose, frames, {-motion_px[0], -motion_px[1]});
            if (!views) return fail(views);

            const int bands = scenery->bands();
            const auto change = [=](const Pixels& before, const Pixels& now) {
              return squares_of_change(std::as_bytes(std::span(before)), std::as_bytes(std::span(now)), width, height,
                                       bands, motion_px);
            };
            const auto ideals = std::make_shared<std::vector<Pixels>>();
            double ideal_squares = 0;
            for (const View& view : *views) {
              const Ideal ideal = ideal_of(view, scenery->content(), rectangle(view, 0, 0, width, height));
              Pixels pixels;
              for (const double value : ideal.image) pixels += static_cast<char>(static_cast<unsigned char>(value));
              if (!ideals->empty()) ideal_squares += change(ideals->back(), pixels) / (frames - 1);
              ideals->push_back(std::move(pixels));
            }

            Comparison comparison{.error_unit = "levels of flicker"};
            comparison.go_on = true;
            comparison.rounds = 3;
            for (const Contestant& contestant :
                 contestants({"nadir draft", "nadir balanced", "nadir best", "original", "GDAL + OpenCV linear",
                              "GDAL + OpenCV linear 2x2", "GDAL + OpenCV cubic", "OpenImageIO aniso"})) {
              Method method{.name = contestant.name, .setting = threads_setting(1)};
              const auto started = start(**setting, contestant, 1);
              if (!started) {
                method.left_out = started.error().message;
                comparison.methods.push_back(std::move(method));
                continue;
              }
              const auto peer = *started;
              method.told = [=] { return fly(*peer, frames, [](int, const Usage&) { return Result<void>{}; }); };
              const auto found = std::make_shared<Result<double>>(0.0);
              method.counters = [=, scratch = (*setting)->scratch]() -> std::map<std::string, std::string> {
                double squares = 0, errors = 0;
                Pixels last;
                const auto flown = fly(*peer, frames, [&](int i, const Usage&) -> Result<void> {
                  auto pixels = peer->samples(scratch);
                  if (!pixels) return fail(pixels);
                  if (i > 0) squares += change(last, *pixels) / (frames - 1);
                  for (std::size_t k = 0; k < pixels->size(); ++k) {
                    const int error = static_cast<unsigned char>((*pixels)[k]) -
                                      static_cast<unsigned char>((*ideals)[static_cast<std::size_t>(i)][k]);
                    errors += error * error / static_cast<double>(pixels->size()) / frames;
                  }
                  last = std::move(*pixels);
                  return {};
                });
                if (!flown) {
                  *found = fail(flown);
                  return {};
                }
                *found = std::sqrt(squares);
                return {{"happened",
                         fmt::format("{:.2f} times the {} of the ideal pictures", std::sqrt(squares / ideal_squares),
                                     short_number(std::sqrt(ideal_squares)))},
                        {"psnr", fmt::format("{:.1f} image", 10 * std::log10(255 * 255 / errors))}};
              };
              method.error = [=] { return *found; };
              comparison.methods.push_back(std::move(method));
            }
            return comparison;
          }};
}

}  // namespace nadir::bench
