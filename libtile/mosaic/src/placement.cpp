#include "nadir/mosaic/placement.h"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>

#include "grid_mapping.h"
#include "resample.h"

namespace nadir::mosaic {
namespace {

constexpr std::int64_t most_texels = std::numeric_limits<std::int32_t>::max();

/// Where the source's first texel lies, if both grids differ by whole texels: the far corners agree within 0.01 texel
/// and the shift is whole within 0.05, which no eye and no instrument sees.
std::optional<std::array<std::int64_t, 2>> whole_shift(const ExactMapping& exact, const Grid& source) {
  if (!exact.affine()) return std::nullopt;
  const double size = static_cast<double>(std::max(source.width, source.height));
  if (!((exact.affine()->linear() - Eigen::Matrix2d::Identity()).cwiseAbs().maxCoeff() * size < 0.01))
    return std::nullopt;
  const Eigen::Vector2d at = exact.affine()->inverse() * Eigen::Vector2d(0, 0);
  const Eigen::Vector2d whole = at.array().round();
  if (!((at - whole).cwiseAbs().maxCoeff() < 0.05) || !(whole.cwiseAbs().maxCoeff() < 0x1p53)) return std::nullopt;
  return std::array{static_cast<std::int64_t>(whole.x()), static_cast<std::int64_t>(whole.y())};
}

/// Texels of `grid` whose centres lie in `box`.
Window centers_within(const Eigen::AlignedBox2d& box, std::int64_t width, std::int64_t height) {
  const auto first = [](double from, std::int64_t size) {
    return static_cast<std::int32_t>(std::clamp(std::ceil(from - 0.5), 0.0, static_cast<double>(size)));
  };
  const auto end = [](double to, std::int64_t size) {
    return static_cast<std::int32_t>(std::clamp(std::floor(to - 0.5) + 1, 0.0, static_cast<double>(size)));
  };
  if (box.isEmpty()) return {};
  const std::int32_t x = first(box.min().x(), width), y = first(box.min().y(), height);
  const std::int32_t x_end = end(box.max().x(), width), y_end = end(box.max().y(), height);
  if (x_end <= x || y_end <= y) return {};
  return {x, y, x_end - x, y_end - y};
}

/// Some place in the source that both mappings agree on, and its place in the target; the middle where they do there.
std::optional<Eigen::Vector2d> defined_place(const ExactMapping& exact, const Grid& source) {
  auto places = lattice(source, 20);
  std::swap(places.front(), places[places.size() / 2]);
  auto target = places;
  exact.target_from_source(target);
  auto back = target;
  exact.source_from_target(back);
  for (std::size_t i = 0; i < places.size(); ++i)
    if ((back[i] - places[i]).norm() < 0.5) return target[i];  // false where NaN
  return std::nullopt;
}

/// The greater singular value of the derivative of source by target texels.
double minification_at(const ExactMapping& exact, const Eigen::Vector2d& target) {
  std::array<Eigen::Vector2d, 4> around = {target + Eigen::Vector2d(0.5, 0), target - Eigen::Vector2d(0.5, 0),
                                           target + Eigen::Vector2d(0, 0.5), target - Eigen::Vector2d(0, 0.5)};
  exact.source_from_target(around);
  Eigen::Matrix2d jacobian;
  jacobian << around[0] - around[1], around[2] - around[3];
  return jacobian.allFinite() ? jacobian.jacobiSvd().singularValues()[0] : 1;
}

/// Bounds in the target of all that the source covers; empty where only the target as a whole is certain to hold it.
std::optional<Eigen::AlignedBox2d> bounds(const ExactMapping& exact, const Grid& target, const Grid& source) {
  Eigen::AlignedBox2d box;
  for (const double lat_deg : {-90.0, 90.0}) {
    if (exact.affine() || !holds_pole(source, lat_deg)) continue;
    const auto pole = pole_in(target, lat_deg);
    if (!pole) return std::nullopt;
    box.extend(*pole);
  }
  for (int sides = exact.affine() ? 1 : 20; sides <= 1280; sides *= 2) {
    auto points = outline(source, sides);
    exact.target_from_source(points);
    const Eigen::AlignedBox2d before = box;
    for (const auto& p : points) {
      if (!p.allFinite()) return std::nullopt;
      box.extend(p);
    }
    if (exact.affine()) return box;
    const bool first = sides == 20;
    if (!first && std::max((before.min() - box.min()).maxCoeff(), (box.max() - before.max()).maxCoeff()) < 0.1)
      return Eigen::AlignedBox2d(box.min() - Eigen::Vector2d(0.5, 0.5), box.max() + Eigen::Vector2d(0.5, 0.5));
  }
  return std::nullopt;
}

Result<void> check(const Grid& target, const Grid& source, const PlacementOptions& options) {
  for (const Grid* grid : {&target, &source}) {
    if (grid->width < 1 || grid->height < 1 || std::max(grid->width, grid->height) > most_texels)
      return fail(Error::Kind::Unsupported, fmt::format("expected a raster of 1 to {} texels a side, found {} x {}",
                                                        most_texels, grid->width, grid->height));
    if (!(std::abs(grid->crs_from_texel.linear().determinant()) > 0) || !grid->crs_from_texel.matrix().allFinite())
      return fail(Error::Kind::Malformed, "expected a geotransform that spans an area, found texels of no size");
  }
  if (!(options.tolerance_texels > 0))
    return fail(Error::Kind::Malformed,
                fmt::format("expected a tolerance above 0 texels, found {}", options.tolerance_texels));
  if (options.power && (!std::isfinite(options.offset) || !std::isnormal(options.scale)))
    return fail(Error::Kind::Malformed, fmt::format("expected decibels = sample * scale + offset with a scale that is "
                                                    "not 0, found {} and {}",
                                                    options.scale, options.offset));
  return {};
}

}  // namespace

struct Placement::State {
  State(const Grid& target, const Grid& source, const PlacementOptions& how)
      : options(how), mapping(target, source, how.tolerance_texels) {}

  /// Those of the window that was last asked for are kept a thread: needed() and resample() ask in turn.
  const std::vector<Patch>& patches(const Window& window) const {
    struct Last {
      std::uint64_t serial = 0;
      Window window;
      std::vector<Patch> patches;
    };
    static thread_local Last last;
    const auto same = [](const Window& a, const Window& b) {
      return a.x == b.x && a.y == b.y && a.width == b.width && a.height == b.height;
    };
    if (last.serial != serial || !same(last.window, window)) last = {serial, window, mapping.patches(window)};
    return last.patches;
  }

  static std::uint64_t next_serial() {
    static std::atomic<std::uint64_t> count{0};
    return ++count;
  }

  const std::uint64_t serial = next_serial();  // never 0, never that of another
  const PlacementOptions options;
  const GridMapping mapping;
  std::int32_t source_width = 0, source_height = 0;
  std::optional<std::array<std::int64_t, 2>> shift;
  double minification = 1;
  Window covered;
};

Result<Placement> Placement::create(const Grid& target, const Grid& source, const PlacementOptions& options) {
  if (const auto ok = check(target, source, options); !ok) return fail(ok);
  auto state = std::make_shared<State>(target, source, options);
  state->source_width = static_cast<std::int32_t>(source.width);
  state->source_height = static_cast<std::int32_t>(source.height);
  const ExactMapping& exact = state->mapping.exact();
  const auto place = defined_place(exact, source);
  if (!place)
    return fail(
        Error::Kind::Unsupported,
        fmt::format("no texel of it, in {}, is defined in {}, the CRS of the map; leave it out, or choose a CRS "
                    "that covers all sources",
                    source.projection.name(), target.projection.name()));
  state->minification = minification_at(exact, *place);
  state->shift = whole_shift(exact, source);
  if (state->shift) {
    const Eigen::Vector2d first(static_cast<double>((*state->shift)[0]), static_cast<double>((*state->shift)[1]));
    const Eigen::Vector2d size(static_cast<double>(source.width), static_cast<double>(source.height));
    state->covered = centers_within(Eigen::AlignedBox2d(first, first + size), target.width, target.height);
  } else if (const auto box = bounds(exact, target, source)) {
    state->covered = centers_within(*box, target.width, target.height);
  } else {
    state->covered = {0, 0, static_cast<std::int32_t>(target.width), static_cast<std::int32_t>(target.height)};
  }
  return Placement(std::move(state));
}

std::optional<std::array<std::int64_t, 2>> Placement::shift() const { return state_->shift; }
double Placement::minification() const { return state_->minification; }
Window Placement::covered() const { return state_->covered; }
std::int64_t Placement::exact_points() const { return state_->mapping.exact().points(); }

Window Placement::needed(const Window& target) const {
  const Window window = intersection(target, state_->covered);
  if (window.width == 0) return {};
  const Window source{0, 0, state_->source_width, state_->source_height};
  if (const auto& shift = state_->shift)
    return intersection({static_cast<std::int32_t>(window.x - (*shift)[0]),
                         static_cast<std::int32_t>(window.y - (*shift)[1]), window.width, window.height},
                        source);

  // A bilinear patch lies within the hull of its corners: so do its parts.
  Eigen::AlignedBox2d box;
  for (const Patch& patch : state_->patches(window)) {
    const Window part = intersection(patch.rect, window);
    for (const int right : {0, part.width})
      for (const int below : {0, part.height})
        box.extend(patch.source(part.x - patch.rect.x + right, part.y - patch.rect.y + below));
  }
  const double margin = reach(state_->options.interpolation) - 0.5 + 0.01;  // texels' centres lie half a texel in
  const Eigen::AlignedBox2d all(Eigen::Vector2d(0, 0),
                                Eigen::Vector2d(static_cast<double>(source.width), static_cast<double>(source.height)));
  if (box.isEmpty() || !box.intersects(all)) return {};
  const auto first = [&](double from) { return static_cast<std::int32_t>(std::floor(std::max(0.0, from - margin))); };
  const auto end = [&](double to, std::int32_t size) {
    return static_cast<std::int32_t>(std::min<double>(size, std::ceil(to + margin)));
  };
  const std::int32_t x = std::min(first(box.min().x()), source.width - 1);
  const std::int32_t y = std::min(first(box.min().y()), source.height - 1);
  return {x, y, std::max(end(box.max().x(), source.width), 1) - x, std::max(end(box.max().y(), source.height), 1) - y};
}

void Placement::resample(const TexelType& type, const Block& source, Block& target) const {
  const Window window = intersection(target.window(), state_->covered);
  if (window.width == 0 || source.window().width <= 0 || source.window().height <= 0) return;
  if (state_->shift) return copy(type, *state_->shift, window, source, target);
  const Resampling resampling{type, state_->options, state_->source_width, state_->source_height};
  mosaic::resample(resampling, state_->patches(window), window, source, target);
}

}  // namespace nadir::mosaic
