#include "nadir/render/layer_plan.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "block_windows.h"
#include "nadir/base/text.h"
#include "nadir/render/level_of_detail.h"

namespace nadir::render {
namespace {

constexpr std::array<std::string_view, 5> filter_names = {"nearest", "bilinear", "bicubic", "mip", "reference"};
constexpr std::array<std::string_view, 3> quality_names = {"draft", "balanced", "best"};

// Oversampling a little above what samples are counted for: where a pixel spans a power of two of texels, as views of
// pyramids often do, one level is read then, and not a blend of it with a coarser one.

/// Most blocks read one level then, for up to 2 dB (`nadir bench render`), and switches still show no seam.
constexpr double narrow_blend = 0.25;

/// More cells than this and a block is cut.
constexpr std::int64_t most_cells_a_block = 16;

class LayerPlanner {
 public:
  LayerPlanner(const tile::CellSource& source, const Sampling& sampling, const RowRange& rows)
      : map_(source.map()),
        sampling_(sampling),
        rows_(rows),
        map_size_(map_.width(), map_.height()),
        around_(counts_turns(map_)) {
    const auto& coarsest = map_.levels().back();
    coarsest_texels_ = std::sqrt(coarsest.texels_x * coarsest.texels_y);
    plan_.finest_level = static_cast<int>(map_.levels().size());
  }

  void add(const Patch& patch) {
    const std::int64_t pixels = pixels_of(patch.rect);
    switch (patch.kind) {
      case Patch::Kind::NoGround:
        plan_.pixels_no_ground += pixels;
        break;
      case Patch::Kind::OffMap:
        plan_.pixels_off_map += pixels;
        break;
      case Patch::Kind::PerPixel:
        add_per_pixel(patch);
        break;
      case Patch::Kind::Homography:
      case Patch::Kind::Biquadratic:
        cut(patch, patch.rect);
        break;
    }
  }

  LayerPlan take() {
    if (plan_.blocks.empty()) plan_.finest_level = 0;
    return std::move(plan_);
  }

 private:
  /// Pixels of a rectangle in the rows that are planned.
  std::int64_t pixels_of(const PixelRect& rect) const {
    return static_cast<std::int64_t>(rect.width) * rows_.shared(rect);
  }

  /// Along the frame's grid of blocks
  void cut(const Patch& patch, const PixelRect& rect) {
    for (int y = rect.y; y < rect.y + rect.height;) {
      const int next_y = std::min(rect.y + rect.height, (y / block_px + 1) * block_px);
      for (int x = rect.x; x < rect.x + rect.width;) {
        const int next_x = std::min(rect.x + rect.width, (x / block_px + 1) * block_px);
        const PixelRect block{x, y, next_x - x, next_y - y};
        patch.kind == Patch::Kind::Homography ? add_homography(patch, block) : add_biquadratic(patch, block);
        x = next_x;
      }
      y = next_y;
    }
  }

  void add_homography(const Patch& patch, const PixelRect& rect) {
    if (!rows_.meets(rect)) return;
    PlannedBlock block;
    block.rect = rect;
    BlockSampling& s = block.sampling;

    // Compose pixel -> CRS with CRS -> texel, counted from this block's corner.
    const Eigen::Affine2d& texel_from_crs = map_.texel_from_crs();
    Eigen::Matrix3d to_patch = Eigen::Matrix3d::Identity();
    to_patch.topRightCorner<2, 1>() = Eigen::Vector2d(rect.x, rect.y) - patch.corner();
    s.texel_from_image = patch.crs_from_image * to_patch;
    s.texel_from_image.topRows<2>() = (texel_from_crs.linear() * s.texel_from_image.topRows<2>()).eval();
    s.texel_origin = texel_from_crs * patch.crs_origin;

    const double w = rect.width, h = rect.height;
    const std::array<Eigen::Vector2d, 4> corners = {Eigen::Vector2d(0, 0), {w, 0}, {w, h}, {0, h}};
    Eigen::AlignedBox2d bounds;
    for (const auto& corner : corners) bounds.extend(s.texel_origin + apply(s.texel_from_image, corner));
    for (std::size_t i = 0; i < 4; ++i) choose_level(block, i, jacobian(s.texel_from_image, corners[i]));
    if (place(block, bounds)) return;

    for (const PixelRect& half : rect.halves()) add_homography(patch, half);
  }

  void add_biquadratic(const Patch& patch, const PixelRect& rect) {
    if (!rows_.meets(rect)) return;
    PlannedBlock block;
    block.rect = rect;
    BlockSampling& s = block.sampling;

    // A part of quadratics is quadratics: through nine of its own points, composed with CRS -> texel.
    const Eigen::Vector2d corner = Eigen::Vector2d(rect.x, rect.y) - patch.corner();
    const double w = rect.width, h = rect.height;
    const Eigen::Vector2d origin = patch.biquadratic(corner);
    std::array<Eigen::Vector2d, 9> texels;
    for (int i = 0; i < 9; ++i)
      texels[static_cast<std::size_t>(i)] =
          map_.texel_from_crs().linear() *
          (patch.biquadratic(corner + Eigen::Vector2d(w * (i % 3) / 2, h * (i / 3) / 2)) - origin);
    s.biquadratic.emplace(w, h, texels);
    s.texel_origin = map_.texel_from_crs() * (patch.crs_origin + origin);

    // Between lattice points a quadratic leaves their bounds by an eighth of its second difference at most
    Eigen::AlignedBox2d bounds;
    for (const auto& texel : texels) bounds.extend(s.texel_origin + texel);
    const Eigen::Vector2d bulge = bounds.sizes() / 4;
    bounds.min() -= bulge;
    bounds.max() += bulge;
    const std::array<Eigen::Vector2d, 4> corners = {Eigen::Vector2d(0, 0), {w, 0}, {w, h}, {0, h}};
    for (std::size_t i = 0; i < 4; ++i) choose_level(block, i, s.biquadratic->jacobian(corners[i]));
    if (place(block, bounds)) return;

    for (const PixelRect& half : rect.halves()) add_biquadratic(patch, half);
  }

  void add_per_pixel(const Patch& patch) {
    std::vector<Eigen::Vector2d> texels = patch.crs;
    for (auto& p : texels) p = map_.texel_from_crs() * p;
    // A footprint without bound has the coarsest level, the honest answer at the horizon.
    add_texels(patch.rect, std::move(texels), Eigen::Matrix2d::Identity() * coarsest_texels_);
  }

  /// `texels`: of the pixel centres of `rect`, NaN where no ground is seen; `footprint`: for want of a better.
  void add_texels(const PixelRect& rect, std::vector<Eigen::Vector2d> texels, Eigen::Matrix2d footprint) {
    if (!rows_.meets(rect)) return;
    bring_to_one_turn(texels);
    const auto at = [&](int x, int y) -> const Eigen::Vector2d& {
      return texels[static_cast<std::size_t>(y * rect.width + x)];
    };
    Eigen::AlignedBox2d bounds;
    std::int64_t seen = 0;
    for (const auto& p : texels) {
      if (!p.allFinite()) continue;
      bounds.extend(p);
      ++seen;
    }
    if (seen == 0) {
      plan_.pixels_no_ground += pixels_of(rect);
      return;
    }
    // One Jacobian for all, from the first pixel whose neighbours see ground
    bool found = false;
    for (int y = 0; y + 1 < rect.height && !found; ++y) {
      for (int x = 0; x + 1 < rect.width && !found; ++x) {
        Eigen::Matrix2d j;
        j << at(x + 1, y) - at(x, y), at(x, y + 1) - at(x, y);
        if (around_)  // nor do pixels beside a pole lie a turn apart
          for (int i = 0; i < 2; ++i) j(0, i) = std::remainder(j(0, i), map_size_.x());
        found = j.allFinite();
        if (found) footprint = j;
      }
    }
    const Eigen::Vector2d reach = footprint.cwiseAbs().rowwise().sum() / 2;
    bounds.min() -= reach;
    bounds.max() += reach;

    PlannedBlock block;
    block.rect = rect;
    block.texels = texels;
    block.sampling.jacobian = footprint;
    for (std::size_t i = 0; i < 4; ++i) choose_level(block, i, footprint);
    if (place(block, bounds)) return;
    for (const PixelRect& half : rect.halves()) {
      std::vector<Eigen::Vector2d> part;
      for (int y = half.y; y < half.y + half.height; ++y)
        for (int x = half.x; x < half.x + half.width; ++x) part.push_back(at(x - rect.x, y - rect.y));
      add_texels(half, std::move(part), footprint);
    }
  }

  /// To the turn nearest to the first texel, where the map goes around.
  void bring_to_one_turn(std::vector<Eigen::Vector2d>& texels) const {
    if (!around_) return;
    const auto first = std::find_if(texels.begin(), texels.end(), [](const auto& p) { return p.allFinite(); });
    if (first == texels.end()) return;
    const double x = first->x();
    for (auto& p : texels) p.x() = x + std::remainder(p.x() - x, map_size_.x());
  }

  bool one_sample() const {
    return sampling_.filter == Filter::Nearest || sampling_.filter == Filter::Bilinear ||
           sampling_.filter == Filter::Bicubic;
  }

  void choose_level(PlannedBlock& block, std::size_t corner, const Eigen::Matrix2d& j) {
    BlockSampling& s = block.sampling;
    const auto& levels = map_.levels();
    block.longest_texels = std::max(block.longest_texels, longer_axis(j));
    if (one_sample()) {
      s.level_at_corner[corner] = level_coordinate(levels, footprint_side(j));
      return;
    }
    SamplePattern pattern;
    int most = most_samples_a_side;
    if (sampling_.filter == Filter::Reference) {
      most = most_reference_samples_a_side;
      const auto wanted = [&](const Eigen::Vector2d& across) {
        return sampling_.oversampling * std::max(least_reference_texels, across.norm());
      };
      pattern = {1, wanted(j.col(0)), wanted(j.col(1))};
    } else {
      pattern = footprint_samples(j, sampling_.oversampling, most_samples_a_side, coarsest_texels_);
      s.level_at_corner[corner] = level_coordinate(levels, pattern.texels);
    }
    // A third of a sample too few blurs less than the eye sees; one too many costs as much as the first.
    const auto count = [&](double wanted) {
      const double least = std::ceil(wanted - 0.3);
      block.undersampled = block.undersampled || least > most;
      return static_cast<int>(std::clamp(least, 1.0, static_cast<double>(most)));
    };
    s.samples_x = std::max(s.samples_x, count(pattern.samples_x));
    s.samples_y = std::max(s.samples_y, count(pattern.samples_y));
  }

  /// Finds the levels and cells of a block whose texels lie within `bounds`, and adds it. False where they are too
  /// many: near the horizon an outline spans much that its pixels do not sample.
  bool place(PlannedBlock& block, const Eigen::AlignedBox2d& bounds) {
    BlockSampling& s = block.sampling;
    Eigen::AlignedBox2d map(Eigen::Vector2d::Zero(), map_size_);
    if (around_) map.min().x() = bounds.min().x(), map.max().x() = bounds.max().x();  // it has no ends
    const std::int64_t pixels = pixels_of(block.rect);
    if (!map.intersects(bounds)) {
      plan_.pixels_off_map += pixels;
      return true;
    }
    s.inside = block.texels.empty() && map.contains(bounds);
    s.map_width = map_size_.x();
    s.map_height = map_size_.y();
    s.width = block.rect.width;
    s.height = block.rect.height;
    const bool cubic =
        sampling_.filter == Filter::Bicubic ||
        (sampling_.filter == Filter::Mip && sampling_.cubic_details && block.longest_texels <= most_detail_texels);
    s.interpolation = sampling_.filter == Filter::Nearest ? Interpolation::Nearest
                      : cubic                             ? Interpolation::Cubic
                                                          : Interpolation::Bilinear;
    if (cubic) s.samples_x = s.samples_y = 1;

    const auto [low, high] = std::minmax_element(s.level_at_corner.begin(), s.level_at_corner.end());
    const double middle = *low / 2 + *high / 2;
    if (sampling_.filter == Filter::Bilinear) s.level_at_corner.fill(std::floor(middle + 0.5));  // one level a block
    if (cubic) s.level_at_corner.fill(std::floor(middle));                                       // of detail enough
    s.level_blend.band = sampling_.filter == Filter::Nearest ? 0 : sampling_.level_blend;
    block.seen_min = map.intersection(bounds).min();
    block.seen_max = map.intersection(bounds).max();
    if (find_windows(block, map_) > most_cells_a_block && block.rect.width * block.rect.height > 1) return false;

    plan_.finest_level = std::min(plan_.finest_level, block.windows.front().level);
    plan_.coarsest_level = std::max(plan_.coarsest_level, block.windows.back().level);
    plan_.pixels_sampled += pixels;
    plan_.samples += pixels * s.samples_x * s.samples_y;
    plan_.undersampled = plan_.undersampled || block.undersampled;
    plan_.blocks.push_back(std::move(block));
    return true;
  }

  const tile::Map& map_;
  const Sampling& sampling_;
  const RowRange rows_;
  const Eigen::Vector2d map_size_;
  const bool around_;  // the Earth
  double coarsest_texels_ = 1;
  LayerPlan plan_;
};

}  // namespace

LayerPlan plan_layer(const PatchMapping& mapping, const tile::CellSource& source, const Sampling& sampling,
                     const RowRange& rows) {
  LayerPlanner planner(source, sampling, rows);
  for (const Patch& patch : mapping.patches) planner.add(patch);
  LayerPlan plan = planner.take();
  for (PlannedBlock& block : plan.blocks) block.sampling.texels = block.texels;  // the vectors have come to rest
  return plan;
}

bool same_places(const PlannedBlock& a, const PlannedBlock& b) {
  const auto same_window = [](const LevelWindow& c, const LevelWindow& d) {
    return c.level == d.level && c.texels_x == d.texels_x && c.texels_y == d.texels_y && c.width == d.width &&
           c.height == d.height && c.first_col == d.first_col && c.first_row == d.first_row && c.cols == d.cols &&
           c.rows == d.rows && c.around == d.around;
  };
  const BlockSampling &s = a.sampling, &t = b.sampling;
  return a.rect == b.rect && s.texel_from_image == t.texel_from_image && s.texel_origin == t.texel_origin &&
         s.biquadratic == t.biquadratic && a.texels.empty() && b.texels.empty() &&
         s.level_at_corner == t.level_at_corner && s.level_blend.band == t.level_blend.band &&
         s.samples_x == t.samples_x && s.samples_y == t.samples_y && s.interpolation == t.interpolation &&
         s.map_width == t.map_width && s.map_height == t.map_height && s.inside == t.inside &&
         std::equal(a.windows.begin(), a.windows.end(), b.windows.begin(), b.windows.end(), same_window);
}

std::string_view to_string(Filter filter) { return filter_names[static_cast<std::size_t>(filter)]; }
std::string_view to_string(Quality quality) { return quality_names[static_cast<std::size_t>(quality)]; }
Result<Filter> parse_filter(std::string_view text) { return parse_name<Filter>("filter", text, filter_names); }
Result<Quality> parse_quality(std::string_view text) { return parse_name<Quality>("quality", text, quality_names); }

Sampling sampling_for(Quality quality) {
  switch (quality) {
    case Quality::draft:
      return {.filter = Filter::Bilinear};
    case Quality::best:
      return {.oversampling = 3.1, .level_blend = narrow_blend, .cubic_details = true};
    case Quality::balanced:
      break;
  }
  return {.oversampling = 1.6, .level_blend = narrow_blend};
}

}  // namespace nadir::render
