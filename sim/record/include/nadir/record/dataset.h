#pragma once

#include <cstdint>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/record/banded_frame.h"
#include "nadir/record/feature_file.h"
#include "nadir/record/frame_record.h"
#include "nadir/render/camera.h"
#include "nadir/render/frame.h"
#include "nadir/render/truth_planes.h"

namespace nadir::record {

/// Makes room for a run: a folder with content is refused unless `force` is set, and then an earlier dataset in it
/// goes.
Result<void> clear_dataset(const std::filesystem::path& folder, bool force);

/// A folder of frames and their truth: frames/<vehicle>/<sensor>/<nanoseconds>.{png,tif}, camera/, frames.jsonl, and
/// footprints.geojson for maps: a Feature a frame that was made.
///
/// uint8 and uint16 of up to four bands become PNG, all else TIFF. Invalid pixels are told by a mask beside the frame
/// (<nanoseconds>.mask.png, 255 valid, 0 not), written where there are any; what each pixel sees, where it is given, by
/// <nanoseconds>.truth.tif (truth_plane_file.h). Images are written in the background, two frames behind at most; a
/// frame's record is written after its image, so that what frames.jsonl lists is there, and its footprint after that.
/// One thread at a time.
class Dataset {
 public:
  /// Makes the folder. A folder with content is refused, unless `force` is set: then an earlier dataset's frames,
  /// telemetry and records in it are removed first.
  static Result<Dataset> create(const std::filesystem::path& folder, bool force);
  Dataset(Dataset&&) = default;
  Dataset& operator=(Dataset&&) = default;

  Result<void> add_camera(const std::string& vehicle, const render::Camera& camera);
  /// Lines of `time_budget_record`, all at once.
  Result<void> write_time_budgets(const std::vector<std::string>& lines);

  /// Each layer is a sensor of that name. `masks`: write masks; else invalid pixels stand as they are. `planes`: of the
  /// frame's pose, which all layers share: one file, in the first one's folder, that the records of all name.
  Result<void> add(render::Frame frame, std::int64_t time_ns, const std::string& vehicle, bool masks,
                   std::optional<render::TruthPlanes> planes = {});
  /// Begins a frame that comes in bands, from which `add` makes files and records as of a whole one. Its images are
  /// written while bands are added to it.
  Result<BandedFrame> begin_bands(std::int64_t time_ns, const std::string& vehicle, bool masks);
  /// `whole`: of Renderer::render_bands, whose bands were added.
  Result<void> add(BandedFrame bands, const render::Frame& whole);
  Result<void> add_rejected(const std::vector<std::string>& sensors, std::int64_t time_ns, const std::string& vehicle,
                            const std::string& reason);

  /// Waits until all is written. Must be called; until then the last frames may be missing.
  Result<void> finish();

 private:
  explicit Dataset(std::filesystem::path folder) : folder_(std::move(folder)) {}
  Result<void> append_oldest();

  std::filesystem::path folder_;
  struct CloseFile {
    void operator()(std::FILE* file) const noexcept { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, CloseFile> records_;
  std::uintmax_t records_bytes_ = 0;  // of whole records
  std::optional<FeatureFile> footprints_;
  std::deque<std::future<Result<FrameRecords>>> pending_;  // each gives its frame's
};

}  // namespace nadir::record
