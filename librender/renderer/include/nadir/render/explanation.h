#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nadir/render/frame_counters.h"
#include "nadir/render/quality.h"
#include "nadir/render/truth.h"
#include "nadir/tile/role.h"
#include "nadir/tile/sample_type.h"

namespace nadir::render {

/// What of a layer is sampled from one level.
struct LevelUse {
  int level = 0;
  std::int64_t blocks = 0, pixels = 0;  // that may sample it; those blended between two levels count in both
};

/// How one layer of a frame was made.
struct LayerExplanation {
  std::string name, map, crs;
  tile::Role role = tile::Role::Optical;
  tile::SampleType type = tile::SampleType::UInt8;  // of its cells
  int bands = 0, bands_of_map = 0;

  // Mapping from pixels to the CRS
  bool mapping_shared = false;  // with an earlier layer
  bool closed_form = false;     // the CRS needs no projection library
  std::int64_t homographies = 0, quadratics = 0, patches_by_pixel = 0;
  double mapping_error_px = 0, tolerance_px = 0;  // greatest found where checked; asked for

  // Plan
  Filter filter = Filter::Mip;
  double oversampling = 1;
  int levels_of_map = 0;
  std::vector<LevelUse> levels;  // from the finest to the coarsest
  std::int64_t blocks = 0, samples = 0;
  std::int64_t pixels = 0, pixels_sampled = 0, pixels_no_ground = 0, pixels_off_map = 0;
  std::int64_t cells = 0;
  std::uint64_t cell_bytes = 0;  // of all of them, at most
  bool undersampled = false;     // see Truth
  std::optional<double> expected_rmse;
  std::optional<CoarseFill> coarse;  // see Truth

  double samples_a_pixel() const {
    return pixels_sampled > 0 ? static_cast<double>(samples) / static_cast<double>(pixels_sampled) : 0;
  }
};

/// How a frame was made; of an exposure, its first instant.
struct Explanation {
  std::vector<LayerExplanation> layers;
  bool plane = true;       // the surface; else an ellipsoid
  bool ideal_lens = true;  // a pinhole
  std::optional<Exposure> exposure;
  // Of a frame in bands; layers are then told of the first one
  std::int64_t bands = 1;
  int band_rows = 0;
  FrameCounters counters;
};

/// What was done, what was left out, and why, in lines for people. The same for the same frame: no times.
struct ExplanationText {
  std::vector<std::string> done, left_out;
};
ExplanationText to_text(const Explanation& explanation);

/// "2.5 ms: mapping 0.01 (0.4 %), ..."
std::string to_text(const StageTimes& times);

}  // namespace nadir::render
