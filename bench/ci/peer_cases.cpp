#include "peer_cases.h"

#include <fmt/format.h>

#include <array>

#include "contestants.h"

namespace nadir::bench {
namespace {

constexpr int width = 640, height = 480;
constexpr std::int64_t map_side = 8192;  // both poses fit
constexpr double ideal_budget = 1e7;     // samples of the map for the ideal: a tenth of a second
constexpr int rounds = 15;               // of a quarter of a second

struct Pair {
  std::string ours, peer;
};
const std::array<Pair, 3> pairs = {{{"nadir draft", "GDAL + OpenCV linear"},
                                    {"nadir balanced", "GDAL + OpenCV linear 2x2"},
                                    {"nadir best", "GDAL + OpenCV linear 4x4"}}};

Case beside_peers(const RunOptions& options, const Pose& pose) {
  return {fmt::format("beside peers, {}", pose.name), [=]() -> Result<Comparison> {
            MapKind kind;
            kind.side = map_side;
            RunOptions in_full = options;
            in_full.quick = false;
            const auto scenery = std::make_shared<const Scenery>(in_full, kind);
            const auto setting = setting_of(in_full, scenery, pose, width, height, "none", ideal_budget);
            Comparison comparison{.error_unit = "levels RMS", .go_on = true, .rounds = rounds};
            const auto add = [&](const std::string& name) {
              comparison.methods.push_back(setting ? method_of(*setting, contestants({name})[0], 1)
                                                   : Method{.name = name, .setting = threads_setting(1)});
              if (!setting) comparison.methods.back().left_out = setting.error().message;
            };
            for (const Pair& pair : pairs) {
              add(pair.ours);
              add(pair.peer);
              comparison.aims.push_back({.method = label(pair.ours, threads_setting(1)),
                                         .baseline = label(pair.peer, threads_setting(1)),
                                         .most = std::nullopt,
                                         .cost = Cost::cpu});
            }
            return comparison;
          }};
}

}  // namespace

std::vector<Case> peer_cases(const RunOptions& options) {
  std::vector<Case> cases;
  for (const Pose& pose : poses())
    if (pose.name == "n8" || pose.name == "o75") cases.push_back(beside_peers(options, pose));
  return cases;
}

}  // namespace nadir::bench
