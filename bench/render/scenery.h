#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "ideal.h"
#include "nadir/bench/runner.h"
#include "nadir/tile/map.h"
#include "view.h"

namespace nadir::bench {

/// A camera over the middle of a map, image top 4 degrees east of north.
struct Pose {
  std::string name;
  double texels = 1;     // of the map to a pixel, across the line of sight at the image's middle
  double pitch_deg = 0;  // from straight down, forward
  bool wide = false;     // sees more than the usual map has
};

/// n1 straight down at 1:1, n8 and n64 zoomed out 8 and 64 times, o45 and o75 oblique, low4 zoomed in 4 times.
std::vector<Pose> poses();

constexpr double usual_texel_m = 0.3;

/// `right_px`, `down_px`: the camera moved so far along its image axes, by what a pixel in the middle shows.
/// Error where the image sees more than the map has.
Result<View> view_of(const Pose& pose, int width, int height, const tile::Map& map, double texel_m = usual_texel_m,
                     double right_px = 0, double down_px = 0);

/// What the maps of a suite are like.
struct MapKind {
  SampleType type = SampleType::u8;
  int bands = 3;
  std::int64_t side = 16384;
};

/// Maps of known content, made where they are first asked for in the suite's scratch folder, and used again.
class Scenery {
 public:
  Scenery(const RunOptions& options, MapKind kind) : folder_(options.scratch), quick_(options.quick), kind_(kind) {
    if (quick_) kind_.side /= 4;
  }

  const MapContent& content() const;
  double peak() const { return content().peak(); }
  SampleType type() const { return kind_.type; }
  int bands() const { return kind_.bands; }

  /// The content with its levels, equal tiles stored once, so that the file is small; marked as a texture. `side`: 0
  /// for the usual one.
  Result<std::string> repeated(std::int64_t side = 0) const;
  /// That map as `nadir build` packs it, each tile where its place is.
  Result<std::string> built(const std::string& codec) const;
  static constexpr std::int64_t wide_side = 131'072;

 private:
  std::string file(const std::string& what, std::int64_t side) const;
  std::filesystem::path folder_;
  bool quick_;
  MapKind kind_;
  mutable std::shared_ptr<const RepeatedContent> repeated_;
  mutable std::optional<MapContent> content_;
};

}  // namespace nadir::bench
