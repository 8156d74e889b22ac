#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>

#include "nadir/render/camera.h"
#include "nadir/render/frame.h"
#include "nadir/render/motion.h"
#include "nadir/render/quality.h"
#include "nadir/render/scene.h"
#include "nadir/tile/cell_cache.h"

namespace nadir::render {

struct LayerPlan;

/// What happens where a frame sees what no map covers.
enum class OffMap {
  Mask,    // those pixels are marked invalid; of float layers they are NaN, else 0
  Fill,    // those pixels get a value
  Reject,  // no frame: Error::OutsideMap, where a corner of the image is off a map
};
std::string_view to_string(OffMap off_map);
Result<OffMap> parse_off_map(std::string_view text);

struct RenderOptions {
  Quality quality = Quality::balanced;
  std::optional<Filter> filter;                     // instead of the quality's; labels are always sampled nearest
  std::optional<double> oversampling, level_blend;  // likewise: see Sampling
  /// In the frame's values: each layer takes the cheapest way of sampling whose expected error is within it (see
  /// Truth::expected_rmse), or the finest there is. It overrides the quality, the filter and the fields above.
  std::optional<double> max_error;
  double geometry_tolerance_px = 0.05;  // backward error, in (0, 1]
  OffMap off_map = OffMap::Mask;
  double fill_value = 0;      // with OffMap::Fill
  double motion_step_px = 2;  // of motion in the image, at most, between the poses that stand for an exposure; over 0
  /// Do not wait for map tiles that are not in memory: a block of pixels whose cells are not all there is sampled from
  /// the finest coarser level whose cells are, in the last resort from the coarsest, which alone is read. What was
  /// missing is loaded in the background for coming frames. Such frames hang on what was in memory: they are outside
  /// the promise of the same bytes, and say what of them is coarse (Truth::coarse). A layer of role Labels waits unless
  /// its map says that it holds labels, as nadir build has it say, which never blends them.
  bool allow_coarse = false;
  bool explain = false;   // fill in Frame::explanation
  bool adaptive = false;  // noted in Truth: the way of sampling hangs on how long earlier frames took
};

struct RendererOptions {
  std::uint64_t cache_bytes = 256ull << 20;  // for decoded map tiles, GDAL's among them; pinned ones count
  int threads = 0;                           // 0: as many as the machine has
  /// At most so much memory of frames that are gone is kept for frames of the same size to come.
  std::uint64_t spare_frame_bytes = 64ull << 20;
};

/// Renders frames, keeping what it read of maps for the next one.
/// Thread-safe: frames rendered at the same time share the budget.
class Renderer {
 public:
  explicit Renderer(const RendererOptions& options = {});
  ~Renderer();
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;

  /// One frame with all layers of the scene. The same bytes for any thread count, budget and history, unless
  /// `options.allow_coarse`.
  Result<Frame> render(const Scene& scene, const Camera& camera, const CameraPose& ecef_from_camera,
                       const RenderOptions& options = {});

  /// The frame of a camera in motion, whose times count from the frame's stamp: the mean over each row's exposure of
  /// frames at poses at most `options.motion_step_px` of motion apart. Labels are those of the middle of the exposure.
  /// An instant shutter makes the same frame as the pose at the stamp.
  Result<Frame> render(const Scene& scene, const Camera& camera, const CameraMotion& motion, const Shutter& shutter,
                       const RenderOptions& options = {});

  /// As `render`, in bands of `band_rows` rows (fewer in the last), from the top, each given to `sink` in its turn:
  /// memory is that of the cache and of a band, whatever the frame's height. Together they are the bytes of the whole
  /// frame. Multiples of block_px rows cost least, since blocks across two bands are sampled in both. Returns the frame
  /// without pixels, with all of its truth; the truth of a band lacks damage and valid fraction. What is chosen for
  /// whole frames (`max_error`) is chosen by planning all bands beforehand.
  /// Error: Unsupported with `allow_coarse`, and what `sink` returns.
  using BandSink = std::function<Result<void>(const Frame& band, int first_row)>;
  Result<Frame> render_bands(const Scene& scene, const Camera& camera, const CameraPose& ecef_from_camera,
                             const RenderOptions& options, int band_rows, const BandSink& sink);
  Result<Frame> render_bands(const Scene& scene, const Camera& camera, const CameraMotion& motion,
                             const Shutter& shutter, const RenderOptions& options, int band_rows, const BandSink& sink);

  /// Begins to load, in the background, what a frame at a coming pose will sample: no byte of any frame hangs on it.
  /// Destroyed or replaced, the ticket cancels what of that has not begun. What is wrong with the frame is left for
  /// `render` to say.
  [[nodiscard]] tile::CellCache::Ticket prefetch(const Scene& scene, const Camera& camera,
                                                 const CameraPose& ecef_from_camera, const RenderOptions& options = {});
  /// Waits until that is done, and what frames with `allow_coarse` found missing is loaded.
  void wait_for_prefetch() { cache().wait_for_prefetch(); }

  tile::CacheCounters cache_counters() const;
  FrameMemoryCounters frame_memory_counters() const;

 private:
  /// `middle`: of the frame's truth; `instants`: whose mean the frame is, one alone being the middle itself.
  Result<Frame> expose(const Scene& scene, const ExactChain& middle, std::span<const ExactChain> instants,
                       const RenderOptions& options);
  Result<Frame> expose_in_bands(const Scene& scene, const ExactChain& middle, std::span<const ExactChain> instants,
                                const RenderOptions& options, int band_rows, const BandSink& sink);
  struct Band;
  /// Fills the frame's layers, which hold all rows, or those of `band` where there is one.
  Result<void> expose_rows(const Scene& scene, const ExactChain& middle, std::span<const ExactChain> instants,
                           const RenderOptions& options, const Band* band, Frame& frame, std::set<std::string>& damage);
  /// Plans a layer of a whole frame, and notes how. `held`: takes the cells that it counts on to be in memory.
  Result<LayerPlan> plan_whole(const Layer& layer, const PatchMapping& mapping, const RenderOptions& options,
                               bool first, FrameLayer& out, std::vector<tile::CellPtr>& held);
  /// Samples the layers whose indices are given, as they are at one instant.
  Result<void> sample(const Scene& scene, const ExactChain& chain, std::span<const std::size_t> which,
                      const RenderOptions& options, std::size_t instant, const Band* band, Frame& frame,
                      std::set<std::string>& damage);
  tile::CellCache& cache();
  struct Engine;
  std::unique_ptr<Engine> engine_;
};

}  // namespace nadir::render
