#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace nadir::bench {

/// A scene that is known everywhere, and of which the mean under any parallelogram has a closed form: waves of all
/// lengths between one texel and `side` texels that repeat after `side` texels in both directions.
class KnownContent {
 public:
  static constexpr int most_bands = 4;

  /// `side`: a power of two. The texels span [least, most]; between them and finer than they are, the scene may leave
  /// it a little.
  KnownContent(int side, int bands, double least, double most);

  int side() const { return side_; }
  int bands() const { return bands_; }

  /// Mean of each band under the parallelogram around `centre`, in texels, whose sides are the columns of `sides`.
  std::array<double, most_bands> mean(const Eigen::Vector2d& centre, const Eigen::Matrix2d& sides) const;

  /// The mean under each texel: side * side * bands, bands interleaved; rounded where `whole`.
  std::vector<float> texels(bool whole) const;

 private:
  struct Wave {
    Eigen::Vector2d turns;  // a texel to the right and down
    double phase = 0;       // in turns
    std::array<double, most_bands> amplitude{};
  };
  int side_, bands_;
  std::vector<Wave> waves_;
  double middle_ = 0;
};

}  // namespace nadir::bench
