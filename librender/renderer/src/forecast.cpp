#include "forecast.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "nadir/render/homography.h"

namespace nadir::render {
namespace {

/// Losses are stored for whole tiles, and power is not spread evenly: predictions from them are this much too high, in
/// the mean over the views of tests/renderer/forecast_test.cpp.
constexpr double measured_share = 0.7;

/// Octaves finer than a footprint that still matter, as ErrorModel has it.
constexpr int octaves_above = 4;

Eigen::Matrix2d jacobian_at_middle(const BlockSampling& s) {
  const Eigen::Vector2d middle(s.width / 2.0, s.height / 2.0);
  if (s.biquadratic) return s.biquadratic->jacobian(middle);
  return s.texels.empty() ? jacobian(s.texel_from_image, middle) : s.jacobian;
}

Forecast::View view_of(const PlannedBlock& block) {
  const BlockSampling& s = block.sampling;
  const Eigen::Matrix2d j = jacobian_at_middle(s);
  Forecast::View view;
  view.footprint = {.width = j.col(0).norm(),
                    .height = j.col(1).norm(),
                    .samples_x = s.samples_x,
                    .samples_y = s.samples_y,
                    .cubic = s.interpolation == Interpolation::Cubic};
  double coordinate = 0;
  for (const double at_corner : s.level_at_corner) coordinate += at_corner / 4;
  const LevelBlend::Choice choice = s.level_blend(coordinate);
  view.footprint.level = choice.finer;
  view.footprint.coarser = choice.coarser;
  view.octave = static_cast<int>(std::floor(std::log2(std::max({view.footprint.width, view.footprint.height, 1.0}))));
  for (const LevelWindow& w : block.windows) {
    const double side = tile::cell_size;
    view.texels.extend(Eigen::Vector2d(w.first_col * side * w.texels_x, w.first_row * side * w.texels_y));
    view.texels.extend(
        Eigen::Vector2d((w.first_col + w.cols) * side * w.texels_x, (w.first_row + w.rows) * side * w.texels_y));
  }
  view.rect = block.rect;
  return view;
}

/// Losses of all levels over a part of the map; of levels too fine to matter to pixels of an octave, of the first that
/// does. Empty where the map does not tell.
std::vector<double> losses_of(const tile::CellSource& source, const Eigen::AlignedBox2d& texels, int octave) {
  const tile::Map& map = source.map();
  const int levels = static_cast<int>(map.levels().size());
  std::vector<double> losses;
  for (int k = 0; k + 1 < levels; ++k) {
    const int from = std::min(std::max(k, octave - octaves_above), levels - 2);
    const tile::Level& level = map.levels()[static_cast<std::size_t>(from)];
    const auto clamped = [](double texel, std::int32_t size) {
      return static_cast<std::int32_t>(std::clamp(texel, 0.0, size - 1.0));
    };
    const std::int32_t left = clamped(texels.min().x() / level.texels_x, level.width),
                       top = clamped(texels.min().y() / level.texels_y, level.height);
    const tile::Window window{left, top, clamped(texels.max().x() / level.texels_x, level.width) - left + 1,
                              clamped(texels.max().y() / level.texels_y, level.height) - top + 1};
    const auto loss = map.loss(from, window, source.bands());
    if (!loss) return {};
    losses.push_back(*loss);
  }
  return losses;
}

}  // namespace

void Forecast::add(const LayerPlan& plan, const RowRange& rows) {
  for (const PlannedBlock& block : plan.blocks)
    if (block.rect.y >= rows.first && block.rect.y < rows.end) views_.push_back(view_of(block));
}

std::optional<double> Forecast::expected_rmse(const tile::CellSource& source, ErrorModel& model) {
  if (views_.empty()) return std::nullopt;
  std::sort(views_.begin(), views_.end(),
            [](const View& a, const View& b) { return std::pair(a.rect.y, a.rect.x) < std::pair(b.rect.y, b.rect.x); });
  std::map<int, Eigen::AlignedBox2d> seen;  // by octave
  for (const View& view : views_) seen[view.octave].extend(view.texels);
  std::map<int, std::vector<double>> powers;
  for (const auto& [octave, texels] : seen) {
    const auto losses = losses_of(source, texels, octave);
    if (losses.empty()) return std::nullopt;
    powers[octave] = ErrorModel::octave_powers(losses);
  }
  double sum = 0, pixels = 0;
  for (const View& view : views_) {
    const double of_view = static_cast<double>(view.rect.width) * view.rect.height;
    sum += of_view * model.mean_square_error(powers[view.octave], view.footprint);
    pixels += of_view;
  }
  const double rounding = source.type() == tile::SampleType::Float32 ? 0 : 1.0 / 12;
  return std::sqrt(measured_share * measured_share * sum / pixels + rounding);
}

}  // namespace nadir::render
