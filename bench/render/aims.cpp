#include "aims.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "nadir/bench/statistics.h"

namespace nadir::bench {
namespace {

/// What two frames of the same picture may differ in by rounding alone.
constexpr double same_db = 0.05;

struct Found {
  std::string method, setting;
  double ms, image_db, scene_db;
  bool ours() const { return method.starts_with("nadir "); }
  std::string name() const { return label(method, setting); }
};
using Choice = std::function<bool(const Found&)>;

const Found* fastest(const std::vector<Found>& all, const Choice& wanted) {
  const Found* best = nullptr;
  for (const Found& one : all)
    if (wanted(one) && (!best || one.ms < best->ms)) best = &one;
  return best;
}

const Found* named(const std::vector<Found>& all, const std::string& method) {
  return fastest(all, [&](const Found& one) { return one.method == method; });
}

/// "`ours` is so many times as fast as `peer`", if it is at least as good.
Aim times_as_fast(const Found& ours, const Found& peer, double times, const std::string& what) {
  Aim aim{.method = ours.name(), .baseline = peer.name(), .most = 1 / times, .what = what};
  if (ours.image_db < peer.image_db - same_db)
    aim.missed = fmt::format("{:.1f} dB against {:.1f}", ours.image_db, peer.image_db);
  return aim;
}

/// The same, if it reaches a quality whatever the peer's.
Aim reaching(const Found& ours, const Found& peer, double times, const std::string& what, double found_db,
             double least_db) {
  Aim aim{.method = ours.name(), .baseline = peer.name(), .most = 1 / times, .what = what};
  if (found_db < least_db) aim.missed = fmt::format("{:.1f} dB against {:.0f}", found_db, least_db);
  return aim;
}

/// Peers that are both faster and nearer to the ideal than a setting on our front.
void add_beaten(const std::vector<Found>& all, std::vector<Aim>& aims) {
  std::vector<const Found*> ours;
  std::vector<double> times, errors;
  for (const Found& one : all)
    if (one.ours()) {
      ours.push_back(&one);
      times.push_back(one.ms);
      errors.push_back(-one.image_db);
    }
  for (const std::size_t i : pareto_front(times, errors))
    for (const Found& peer : all)
      if (!peer.ours() && peer.ms < ours[i]->ms && peer.image_db > ours[i]->image_db + same_db)
        aims.push_back({.method = ours[i]->name(), .baseline = peer.name(), .most = 1, .what = "beaten"});
}

}  // namespace

std::vector<Aim> aims_of_view(const std::string& pose, const std::vector<Row>& rows) {
  std::vector<std::string> settings;
  std::vector<Found> all;
  for (const Row& row : rows) {
    const auto image = counter(row, "psnr_image_db"), scene = counter(row, "psnr_scene_db");
    if (!row.wall_ms || !image || !scene) continue;
    all.push_back({row.method, row.setting, *row.wall_ms, *image, *scene});
    if (std::find(settings.begin(), settings.end(), row.setting) == settings.end()) settings.push_back(row.setting);
  }
  std::vector<Aim> aims;
  for (const std::string& setting : settings) {
    std::vector<Found> found;
    std::copy_if(all.begin(), all.end(), std::back_inserter(found),
                 [&](const Found& one) { return one.setting == setting; });
    const Found *draft = named(found, "nadir draft"), *balanced = named(found, "nadir balanced"),
                *best = named(found, "nadir best"), *linear = named(found, "GDAL + OpenCV linear"),
                *cubic = named(found, "GDAL + OpenCV cubic"), *fine = named(found, "GDAL + OpenCV linear 4x4"),
                *aniso = named(found, "OpenImageIO aniso");
    if (draft && linear) aims.push_back(times_as_fast(*draft, *linear, setting == "1 thread" ? 1.6 : 2.2, ""));

    constexpr double good_db = 43;
    const auto good = [](bool ours) {
      return [ours](const Found& one) { return one.ours() == ours && one.image_db >= good_db; };
    };
    const Found *our_good = fastest(found, good(true)), *their_good = fastest(found, good(false));
    if (our_good && their_good)
      aims.push_back({.method = our_good->name(), .baseline = their_good->name(), .most = 0.5, .what = "43 dB"});
    add_beaten(found, aims);

    if (best && fine && (pose == "n8" || pose == "n64" || pose == "o75"))
      aims.push_back(reaching(*best, *fine, 3, "50 dB", best->image_db, 50));
    if (best && cubic && pose == "n1") aims.push_back(reaching(*best, *cubic, 2, "39 dB scene", best->scene_db, 39));
    if (best && cubic && pose == "low4") aims.push_back(reaching(*best, *cubic, 2, "31 dB scene", best->scene_db, 31));
    if (balanced && aniso && pose == "o75") aims.push_back(times_as_fast(*balanced, *aniso, 40, ""));
  }
  for (const std::string quality : {"nadir draft", "nadir balanced", "nadir best"})
    if (std::count(settings.begin(), settings.end(), "1 thread") > 0 &&
        std::count(settings.begin(), settings.end(), "2 threads") > 0)
      aims.push_back({.method = label(quality, "2 threads"), .baseline = label(quality, "1 thread"), .most = 1 / 1.8});
  return aims;
}

}  // namespace nadir::bench
