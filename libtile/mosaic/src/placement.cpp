#include "nadir/mosaic/placement.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include "grid_mapping.h"
#include "nadir/mosaic/validity.h"
#include "resample.h"

namespace nadir::mosaic {
namespace {

/// The shift of a mapping that moves whole texels over the whole source, within a twentieth of a texel.
std::optional<std::array<std::int64_t, 2>> whole_shift(const GridMapping& mapping, const Grid& source) {
  if (!mapping.is_affine()) return std::nullopt;
  const Eigen::Matrix2d difference = mapping.affine().linear() - Eigen::Matrix2d::Identity();
  const double side = static_cast<double>(std::max(source.width, source.height));
  if (!(difference.cwiseAbs().maxCoeff() * side < 0.01)) return std::nullopt;
  const Eigen::Vector2d at = -mapping.affine().translation();
  const Eigen::Vector2d whole = at.array().round();
  if (!((at - whole).cwiseAbs().maxCoeff() < 0.05) || !(whole.cwiseAbs().maxCoeff() < 0x1p31)) return std::nullopt;
  return std::array{static_cast<std::int64_t>(whole.x()), static_cast<std::int64_t>(whole.y())};
}

/// What two windows share; width 0 where that is nothing.
Window common(const Window& a, const Window& b) {
  const std::int32_t x = std::max(a.x, b.x), y = std::max(a.y, b.y);
  const Window w{x, y, std::min(a.x + a.width, b.x + b.width) - x, std::min(a.y + a.height, b.y + b.height) - y};
  return w.width > 0 && w.height > 0 ? w : Window{};
}

struct Box {
  double left = std::numeric_limits<double>::infinity(), top = left, right = -left, bottom = -left;
  void add(const Eigen::Vector2d& p) {
    if (!p.allFinite()) return;
    left = std::min(left, p.x());
    top = std::min(top, p.y());
    right = std::max(right, p.x());
    bottom = std::max(bottom, p.y());
  }
  bool empty() const { return !(left <= right); }

  /// Texels of a raster of width x height that it touches, `margin` around it included.
  Window window(double margin, std::int64_t width, std::int64_t height) const {
    const auto clipped = [](double at, std::int64_t size) {
      return static_cast<std::int32_t>(std::clamp(at, 0.0, static_cast<double>(size)));
    };
    if (empty()) return {};
    const std::int32_t x = clipped(std::floor(left - margin), width), y = clipped(std::floor(top - margin), height);
    const Window w{x, y, clipped(std::ceil(right + margin), width) - x,
                   clipped(std::ceil(bottom + margin), height) - y};
    return w.width > 0 && w.height > 0 ? w : Window{};
  }
};

/// Bounds in target texels of a source: its outline, points inside, and a pole if it holds one.
Box bounds_of(const GridMapping& mapping, const Grid& target, const Grid& source) {
  constexpr int steps = 64;
  const double width = static_cast<double>(source.width), height = static_cast<double>(source.height);
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i <= steps; ++i)
    for (int j = 0; j <= steps; ++j)
      if (i % 8 == 0 || j % 8 == 0 || i == steps || j == steps)
        points.emplace_back(width * i / steps, height * j / steps);
  mapping.map_back(points);
  Box box;
  for (const Eigen::Vector2d& p : points) box.add(p);
  for (const double pole : {-std::numbers::pi / 2, std::numbers::pi / 2}) {
    std::vector<Eigen::Vector2d> at = {{0, pole}};
    source.projection.crs_from_lon_lat(at);
    const Eigen::Vector2d texel = source.crs_from_texel.inverse() * at.front();
    if (mapping.is_affine() || !(texel.x() >= 0 && texel.y() >= 0 && texel.x() <= width && texel.y() <= height))
      continue;
    std::vector<Eigen::Vector2d> around;
    for (int i = -12; i <= 12; ++i) around.emplace_back(i * std::numbers::pi / 12, pole * (1 - 1e-12));
    target.projection.crs_from_lon_lat(around);
    for (Eigen::Vector2d& p : around) box.add(target.crs_from_texel.inverse() * p);
  }
  return box;
}

}  // namespace

struct Placement::State {
  State(const Grid& target, const Grid& source, const PlacementOptions& placement)
      : mapping(target, source, placement.tolerance_texels),
        options(placement),
        width(source.width),
        height(source.height) {}

  GridMapping mapping;
  PlacementOptions options;
  std::int64_t width, height;  // of the source
  std::int64_t target_width = 0, target_height = 0;
  std::optional<std::array<std::int64_t, 2>> shift;
  double minification = 1;
  Window covered;
};

Result<Placement> Placement::create(const Grid& target, const Grid& source, const PlacementOptions& options) {
  auto state = std::make_shared<State>(target, source, options);
  state->shift = whole_shift(state->mapping, source);
  state->target_width = target.width;
  state->target_height = target.height;
  if (state->shift) {
    Box box;
    const Eigen::Vector2d corner(static_cast<double>((*state->shift)[0]), static_cast<double>((*state->shift)[1]));
    box.add(corner);
    box.add(corner + Eigen::Vector2d(static_cast<double>(source.width), static_cast<double>(source.height)));
    state->covered = box.window(0, target.width, target.height);
    return Placement(std::move(state));
  }
  const Box box = bounds_of(state->mapping, target, source);
  if (box.empty())
    return fail(
        Error::Kind::Unsupported,
        fmt::format("no part of it is defined in {}: leave it out, or choose another --crs", target.projection.name()));
  // Outlines bend between the points that were looked at.
  const double bend = state->mapping.is_affine() ? 0 : 0.01 * std::max(box.right - box.left, box.bottom - box.top);
  state->covered = box.window(1 + bend, target.width, target.height);

  // At the source's centre: the size of a texel of the target
  std::vector<Eigen::Vector2d> points = {
      Eigen::Vector2d(static_cast<double>(source.width) / 2, static_cast<double>(source.height) / 2)};
  state->mapping.map_back(points);
  points.push_back(points[0] + Eigen::Vector2d(1, 0));
  points.push_back(points[0] + Eigen::Vector2d(0, 1));
  state->mapping.map(points);
  Eigen::Matrix2d jacobian;
  jacobian << points[1] - points[0], points[2] - points[0];
  if (jacobian.allFinite()) state->minification = jacobian.jacobiSvd().singularValues()(0);
  return Placement(std::move(state));
}

std::optional<std::array<std::int64_t, 2>> Placement::shift() const { return state_->shift; }
double Placement::minification() const { return state_->minification; }
Window Placement::covered() const { return state_->covered; }
std::int64_t Placement::exact_points() const { return state_->mapping.exact_points(); }

Window Placement::needed(const Window& target) const {
  const State& s = *state_;
  const Window window = common(target, s.covered);
  if (window.width == 0) return {};
  const double x0 = window.x, y0 = window.y, x1 = x0 + window.width, y1 = y0 + window.height;
  Box box;
  if (s.shift) {
    const Eigen::Vector2d shift(static_cast<double>((*s.shift)[0]), static_cast<double>((*s.shift)[1]));
    box.add(Eigen::Vector2d(x0, y0) - shift);
    box.add(Eigen::Vector2d(x1, y1) - shift);
    return box.window(0, s.width, s.height);
  }
  if (s.mapping.is_affine()) {
    for (const double x : {x0, x1})
      for (const double y : {y0, y1}) box.add(s.mapping.affine() * Eigen::Vector2d(x, y));
  } else {
    for (const MappingPatch& patch : s.mapping.patches(window))
      for (const Eigen::Vector2d& corner : patch.corners) box.add(corner);
  }
  return box.window(reach(s.options, s.minification), s.width, s.height);
}

/// Copies what holds data, texel for texel.
template <class T>
static void copy_over(const TexelType& type, const std::array<std::int64_t, 2>& shift, const Block& source,
                      Block& target) {
  TexelType asked = type;
  asked.mask = source.masked();
  const Validity<T> validity(asked);
  const auto dx = static_cast<std::int32_t>(shift[0]), dy = static_cast<std::int32_t>(shift[1]);
  const Window &from = source.window(), &to = target.window();
  const std::int32_t left = std::max(from.x + dx, to.x), right = std::min(from.x + from.width + dx, to.x + to.width);
  const std::int32_t top = std::max(from.y + dy, to.y), bottom = std::min(from.y + from.height + dy, to.y + to.height);
  if (left >= right) return;
  const auto bands = static_cast<std::size_t>(type.bands), data_bands = static_cast<std::size_t>(type.data_bands());
  for (std::int32_t y = top; y < bottom; ++y) {
    const T* texel = samples_at<T>(source, type, left - dx, y - dy);
    const std::uint8_t* valid = valid_at(source, left - dx, y - dy);
    T* out = reinterpret_cast<T*>(target.row(y)) + static_cast<std::size_t>(left - to.x) * bands;
    std::uint8_t* out_valid = target.masked() ? target.valid_row(y) + (left - to.x) : nullptr;
    if (validity.always()) {
      std::memcpy(out, texel, static_cast<std::size_t>(right - left) * bands * sizeof(T));
      if (out_valid) std::memset(out_valid, 255, static_cast<std::size_t>(right - left));
      continue;
    }
    for (std::int32_t x = left; x < right; ++x, texel += bands, out += bands, valid += valid ? 1 : 0) {
      if (!validity.texel(texel, valid) ||
          std::none_of(texel, texel + data_bands, [&](T sample) { return validity.sample(sample); }))
        continue;
      std::copy_n(texel, bands, out);
      if (out_valid) out_valid[x - left] = 255;
    }
  }
}

void Placement::resample(const TexelType& type, const Block& source, Block& target) const {
  const State& s = *state_;
  if (s.shift) {
    tiff::with_sample(type.sample, [&]<class T>(T) { copy_over<T>(type, *s.shift, source, target); });
    return;
  }
  const Window window = common(target.window(), s.covered);
  if (window.width == 0) return;
  const Resampler resampler(type, s.options, s.minification, s.width, s.height);
  resampler.resample(s.mapping.patches(window), window, source, target);
}

}  // namespace nadir::mosaic
