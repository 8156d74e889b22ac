#include "nadir/render/level_of_detail.h"

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace nadir::render {

double log2_portable(double x) {
  assert(x > 0);
  int exponent = 0;
  double m = std::frexp(x, &exponent);  // exact; m in [0.5, 1)
  if (m < std::numbers::sqrt2 / 2) {
    m *= 2;
    --exponent;
  }
  // ln m = 2 atanh t with t = (m - 1) / (m + 1), |t| <= 0.1716: the next term of the series is below 2 t^9 / 9 = 3e-8.
  const double t = (m - 1) / (m + 1), t2 = t * t;
  return exponent + 2 / std::numbers::ln2 * t * (1 + t2 * (1.0 / 3 + t2 * (1.0 / 5 + t2 / 7)));
}

namespace {
double texels_of(const tile::Level& level) { return std::sqrt(level.texels_x * level.texels_y); }
}  // namespace

double level_coordinate(std::span<const tile::Level> levels, double texels) {
  if (!(texels > 1)) return 0;
  for (std::size_t k = 1; k < levels.size(); ++k) {
    const double coarser = texels_of(levels[k]);
    if (texels >= coarser) continue;
    const double finer = texels_of(levels[k - 1]);
    return static_cast<double>(k - 1) + log2_portable(texels / finer) / log2_portable(coarser / finer);
  }
  return static_cast<double>(levels.size() - 1);
}

double longer_axis(const Eigen::Matrix2d& jacobian) {
  // From the matrix's invariants; half the difference of squares under the root avoids cancellation.
  const double sum = jacobian.squaredNorm() / 2, product = std::abs(jacobian.determinant());
  return std::sqrt(sum + std::sqrt(std::max(0.0, (sum - product) * (sum + product))));
}

SamplePattern footprint_samples(const Eigen::Matrix2d& jacobian, double oversampling, int most_samples,
                                double coarsest_texels) {
  const double longer = longer_axis(jacobian);
  const double shorter = longer > 0 ? std::abs(jacobian.determinant()) / longer : 0;
  SamplePattern pattern;
  pattern.texels = std::min(std::max({shorter / oversampling, longer / most_samples, 1e-12}), coarsest_texels);
  const double spacing = std::max(pattern.texels, 1 / oversampling);  // nothing is finer than level 0
  pattern.samples_x = jacobian.col(0).norm() / spacing;
  pattern.samples_y = jacobian.col(1).norm() / spacing;
  return pattern;
}

double footprint_side(const Eigen::Matrix2d& jacobian) { return std::sqrt(std::abs(jacobian.determinant())); }

}  // namespace nadir::render
