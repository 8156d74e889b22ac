#include "render_suite.h"

#include <fmt/format.h>

#include "contestants.h"

namespace nadir::bench {
namespace {

/// Samples of the map that an ideal picture may take: a second or two.
constexpr double ideal_budget = 1e8;

Case one_view(const RunOptions& options, const Pose& pose, int width, int height, const std::vector<int>& threads) {
  return {fmt::format("{}, {} x {}", pose.name, width, height), [=]() -> Result<Comparison> {
            const auto scenery = std::make_shared<const Scenery>(options, MapKind{});
            const auto setting = setting_of(options, scenery, pose, width, height, "none", ideal_budget);
            if (!setting) return fail(setting);
            Comparison comparison{.error_unit = "levels RMS", .work = width * height / 1e6, .work_unit = "Mpixel"};
            comparison.go_on = true;
            for (const int n : threads)
              for (const Contestant& contestant : contestants())
                comparison.methods.push_back(method_of(*setting, contestant, n));
            return comparison;
          }};
}

}  // namespace

Suite render_suite() {
  return {"render", "frames beside OpenCV, OpenImageIO, libvips, gdalwarp and llvmpipe", [](const RunOptions& options) {
            std::vector<Case> cases;
            for (const Pose& pose : poses())
              cases.push_back(one_view(options, pose, options.quick ? 160 : 640, options.quick ? 120 : 480, {1}));
            return cases;
          }};
}

}  // namespace nadir::bench
