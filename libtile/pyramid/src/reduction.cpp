#include "reduction.h"

#include "axis.h"
#include "cover_filter.h"
#include "taps.h"

namespace nadir::pyramid {
namespace {

/// From the first texel on to behind the last.
struct Span {
  std::int32_t begin = 0, end = 0;
};

Span needed_along(Filter filter, const Axis& axis, const Span& coarse) {
  if (filter == Filter::Nearest) return {Axis::centre(coarse.begin), Axis::centre(coarse.end - 1) + 1};
  if (filter == Filter::Box || filter == Filter::Mode) {
    const Cover last = axis.cover(coarse.end - 1);
    return {axis.cover(coarse.begin).first, last.first + last.count};
  }
  const auto at = [&](std::int32_t i) { return taps(filter, axis.fine, axis.coarse, i, i + 1).front(); };
  const Taps last = at(coarse.end - 1);
  return {at(coarse.begin).first, last.first + static_cast<std::int32_t>(last.weights.size())};
}

}  // namespace

Window Reducer::needed(const Window& coarse) const {
  const Span x = needed_along(reduction_.filter, {fine_.width, coarse_.width}, {coarse.x, coarse.x + coarse.width});
  const Span y = needed_along(reduction_.filter, {fine_.height, coarse_.height}, {coarse.y, coarse.y + coarse.height});
  return {x.begin, y.begin, x.end - x.begin, y.end - y.begin};
}

Window Reducer::parents(const Window& fine) const {
  const Axis x{fine_.width, coarse_.width}, y{fine_.height, coarse_.height};
  const std::int32_t left = x.parent(fine.x), top = y.parent(fine.y);
  return {left, top, x.parent(fine.x + fine.width - 1) + 1 - left, y.parent(fine.y + fine.height - 1) + 1 - top};
}

void Reducer::reduce(const Block& fine, Block& coarse) const {
  const LevelPair pair{type_, reduction_, {fine_.width, coarse_.width}, {fine_.height, coarse_.height}};
  if (reduction_.filter == Filter::Gaussian || reduction_.filter == Filter::Lanczos)
    reduce_by_kernel(pair, fine, coarse);
  else
    reduce_covered(pair, fine, coarse);
}

}  // namespace nadir::pyramid
