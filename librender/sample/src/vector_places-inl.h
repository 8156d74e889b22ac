// Where the samples of a row lie: part of vector_kernels.cpp, and like it compiled once for each instruction set.
#if defined(NADIR_VECTOR_PLACES) == defined(HWY_TARGET_TOGGLE)
#ifdef NADIR_VECTOR_PLACES
#undef NADIR_VECTOR_PLACES
#else
#define NADIR_VECTOR_PLACES
#endif

#include <hwy/highway.h>

#include <type_traits>

#include "kernels.h"

HWY_BEFORE_NAMESPACE();
namespace nadir::render {
namespace HWY_NAMESPACE {
#if HWY_TARGET != HWY_SCALAR && HWY_TARGET != HWY_EMU128
namespace {

namespace hn = hwy::HWY_NAMESPACE;

/// Calls `work` with what a row is, known when compiled: curved, and rational.
template <class Work>
void with_shape(bool curved, bool rational, Work&& work) {
  using std::true_type, std::false_type;
  if (curved)
    rational ? work(true_type(), true_type()) : work(true_type(), false_type());
  else
    rational ? work(false_type(), true_type()) : work(false_type(), false_type());
}

/// The steps of the definition, but for those that change no bit where a row is not `Curved`, or not `Rational`.
template <bool Curved, bool Rational>
void project_row(const RowPath& path, double first, int count, double* u, double* v) {
  const hn::CappedTag<double, row_px> d;
  const auto from = hn::Set(d, first), one = hn::Set(d, 1);
  const auto u0 = hn::Set(d, path.u0), u1 = hn::Set(d, path.u1), u2 = hn::Set(d, path.u2);
  const auto v0 = hn::Set(d, path.v0), v1 = hn::Set(d, path.v1), v2 = hn::Set(d, path.v2);
  const auto w0 = hn::Set(d, path.w0), w1 = hn::Set(d, path.w1), over_w0 = hn::Div(one, w0);
  const auto polynomial = [](auto x, auto a, auto b, auto c) {
    if constexpr (Curved)
      return hn::Add(a, hn::Mul(x, hn::Add(b, hn::Mul(x, c))));
    else
      return hn::Add(a, hn::Mul(x, b));
  };
  auto index = hn::Iota(d, 0.0);
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); i += hn::Lanes(d)) {
    const auto x = hn::Add(from, index);
    const auto over_w = Rational ? hn::Div(one, hn::Add(w0, hn::Mul(x, w1))) : over_w0;
    hn::Store(hn::Mul(polynomial(x, u0, u1, u2), over_w), d, u + i);
    hn::Store(hn::Mul(polynomial(x, v0, v1, v2), over_w), d, v + i);
    index = hn::Add(index, hn::Set(d, static_cast<double>(hn::Lanes(d))));
  }
}
void project(const RowPath& path, double first, int count, double* u, double* v) {
  with_shape(path.u2 != 0 || path.v2 != 0, path.w1 != 0,
             [&](auto curved, auto rational) { project_row<curved(), rational()>(path, first, count, u, v); });
}

/// Texels of a patch, in whole vectors up to a multiple of 8 pixels: those beyond the row lie within the patch too.
template <class D>
struct Holder {
  explicit Holder(const PatchFrame& frame)
      : scale_x(hn::Set(d, frame.scale_x)),
        scale_y(hn::Set(d, frame.scale_y)),
        offset_x(hn::Set(d, frame.offset_x)),
        offset_y(hn::Set(d, frame.offset_y)),
        low(hn::Set(d, frame.low)),
        high_x(hn::Set(d, frame.high_x)),
        high_y(hn::Set(d, frame.high_y)) {}
  using V = hn::Vec<D>;
  V hold(V x, V high) const { return hn::Min(hn::IfThenElse(hn::Ge(x, low), x, low), high); }
  V x(const double* u) const { return hold(hn::Add(hn::Mul(hn::LoadU(d, u), scale_x), offset_x), high_x); }
  V y(const double* v) const { return hold(hn::Add(hn::Mul(hn::LoadU(d, v), scale_y), offset_y), high_y); }
  D d;
  V scale_x, scale_y, offset_x, offset_y, low, high_x, high_y;
};

void place_fixed(const double* u, const double* v, const PatchFrame& frame, int count, Places& places) {
  using D = hn::CappedTag<double, 8>;
  const D d;
  const hn::Rebind<std::int32_t, D> di;
  const hn::Rebind<std::int16_t, D> d16;
  const Holder<D> holder(frame);
  const auto one = hn::Set(d, 1 << fraction_bits), half = hn::Set(d, 0.5);
  const auto mask = hn::Set(di, (1 << fraction_bits) - 1), pitch = hn::Set(di, frame.pitch);
  const std::size_t end = (static_cast<std::size_t>(count) + 7) / 8 * 8;
  for (std::size_t i = 0; i < end; i += hn::Lanes(d)) {
    const auto x = hn::DemoteTo(di, hn::Add(hn::Mul(holder.x(u + i), one), half));
    const auto y = hn::DemoteTo(di, hn::Add(hn::Mul(holder.y(v + i), one), half));
    hn::Store(hn::Add(hn::Mul(hn::ShiftRight<fraction_bits>(y), pitch), hn::ShiftRight<fraction_bits>(x)), di,
              places.at + i);
    hn::Store(hn::DemoteTo(d16, hn::And(x, mask)), d16, places.x15 + i);
    hn::Store(hn::DemoteTo(d16, hn::And(y, mask)), d16, places.y15 + i);
  }
}

void place(const double* u, const double* v, const PatchFrame& frame, int count, Places& places) {
  using D = hn::CappedTag<double, 8>;
  const D d;
  const hn::Rebind<std::int32_t, D> di;
  const hn::Rebind<float, D> df;
  const Holder<D> holder(frame);
  const auto pitch = hn::Set(di, frame.pitch);
  const std::size_t end = (static_cast<std::size_t>(count) + 7) / 8 * 8;
  for (std::size_t i = 0; i < end; i += hn::Lanes(d)) {
    const auto x = holder.x(u + i), y = holder.y(v + i);
    const auto col = hn::DemoteTo(di, x), row = hn::DemoteTo(di, y);
    hn::Store(hn::Add(hn::Mul(row, pitch), col), di, places.at + i);
    hn::Store(hn::DemoteTo(df, hn::Sub(x, hn::PromoteTo(d, col))), df, places.x + i);
    hn::Store(hn::DemoteTo(df, hn::Sub(y, hn::PromoteTo(d, row))), df, places.y + i);
  }
}

/// Texels of a patch from a row's `col` and `row`, up to a multiple of 8 pixels, as above.
template <bool Curved, bool Rational>
class RowPoints {
 public:
  using D = hn::CappedTag<float, 16>;
  using V = hn::Vec<D>;
  RowPoints(const PatchRow& row, const PatchFrame& frame)
      : index_(hn::Iota(d, 0.0f)),
        first_(hn::Set(d, row.first)),
        turn_(hn::Set(d, row.turn)),
        x_{hn::Set(d, row.x), hn::Set(d, row.slope_x), hn::Set(d, row.bend_x),
           hn::Set(d, static_cast<float>(frame.low - row.col)), hn::Set(d, static_cast<float>(frame.high_x - row.col))},
        y_{hn::Set(d, row.y), hn::Set(d, row.slope_y), hn::Set(d, row.bend_y),
           hn::Set(d, static_cast<float>(frame.low - row.row)),
           hn::Set(d, static_cast<float>(frame.high_y - row.row))} {}
  struct Point {
    V x, y;
  };
  /// Of the next pixels, as many as a vector holds.
  HWY_INLINE Point next() {
    const V from_middle = hn::Add(first_, index_);
    index_ = hn::Add(index_, hn::Set(d, static_cast<float>(hn::Lanes(d))));
    const V one = hn::Set(d, 1.0f);
    const V over = Rational ? hn::Div(one, hn::Add(one, hn::Mul(from_middle, turn_))) : one;
    return {at(from_middle, over, x_), at(from_middle, over, y_)};
  }
  D d;

 private:
  struct Axis {
    V middle, slope, bend, low, high;
  };
  static HWY_INLINE V at(V from_middle, V over, const Axis& axis) {
    V slope = axis.slope;
    if constexpr (Curved) slope = hn::Add(slope, hn::Mul(from_middle, axis.bend));
    V way = hn::Mul(from_middle, slope);
    if constexpr (Rational) way = hn::Mul(way, over);
    return hn::Min(hn::Max(hn::Add(axis.middle, way), axis.low), axis.high);
  }
  V index_, first_, turn_;
  Axis x_, y_;
};

template <bool Curved, bool Rational>
void place_points_fixed(const PatchRow& row, const PatchFrame& frame, int count, Places& places) {
  RowPoints<Curved, Rational> points(row, frame);
  using D = typename RowPoints<Curved, Rational>::D;
  const D d;
  const hn::RebindToSigned<D> di;
  const hn::Rebind<std::int16_t, D> d16;
  const auto one = hn::Set(d, 1 << fraction_bits);
  const auto mask = hn::Set(di, (1 << fraction_bits) - 1), pitch = hn::Set(di, frame.pitch),
             col = hn::Set(di, row.col * (1 << fraction_bits)), first_row = hn::Set(di, row.row * (1 << fraction_bits));
  const std::size_t end = (static_cast<std::size_t>(count) + 7) / 8 * 8;
  for (std::size_t i = 0; i < end; i += hn::Lanes(d)) {
    const auto point = points.next();
    const auto x = hn::Add(hn::NearestInt(hn::Mul(point.x, one)), col),
               y = hn::Add(hn::NearestInt(hn::Mul(point.y, one)), first_row);
    hn::Store(hn::Add(hn::Mul(hn::ShiftRight<fraction_bits>(y), pitch), hn::ShiftRight<fraction_bits>(x)), di,
              places.at + i);
    hn::Store(hn::DemoteTo(d16, hn::And(x, mask)), d16, places.x15 + i);
    hn::Store(hn::DemoteTo(d16, hn::And(y, mask)), d16, places.y15 + i);
  }
}

template <bool Curved, bool Rational>
void place_points(const PatchRow& row, const PatchFrame& frame, int count, Places& places) {
  RowPoints<Curved, Rational> points(row, frame);
  using D = typename RowPoints<Curved, Rational>::D;
  const D d;
  const hn::RebindToSigned<D> di;
  const auto pitch = hn::Set(di, frame.pitch), first_col = hn::Set(di, row.col), first_row = hn::Set(di, row.row);
  const std::size_t end = (static_cast<std::size_t>(count) + 7) / 8 * 8;
  for (std::size_t i = 0; i < end; i += hn::Lanes(d)) {
    const auto point = points.next();
    const auto col = hn::Floor(point.x), line = hn::Floor(point.y);
    hn::Store(hn::Add(hn::Mul(hn::Add(hn::ConvertTo(di, line), first_row), pitch),
                      hn::Add(hn::ConvertTo(di, col), first_col)),
              di, places.at + i);
    hn::Store(hn::Sub(point.x, col), d, places.x + i);
    hn::Store(hn::Sub(point.y, line), d, places.y + i);
  }
}

void place_row_fixed(const PatchRow& row, const PatchFrame& frame, int count, Places& places) {
  with_shape(row.bend_x != 0 || row.bend_y != 0, row.turn != 0,
             [&](auto curved, auto rational) { place_points_fixed<curved(), rational()>(row, frame, count, places); });
}
void place_row(const PatchRow& row, const PatchFrame& frame, int count, Places& places) {
  with_shape(row.bend_x != 0 || row.bend_y != 0, row.turn != 0,
             [&](auto curved, auto rational) { place_points<curved(), rational()>(row, frame, count, places); });
}

}  // namespace
#endif
}  // namespace HWY_NAMESPACE
}  // namespace nadir::render
HWY_AFTER_NAMESPACE();
#endif
