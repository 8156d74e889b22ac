#include "nadir/record/dataset.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "frame_paths.h"
#include "nadir/base/files.h"
#include "nadir/record/event_record.h"
#include "nadir/record/image_files.h"
#include "nadir/record/time_budget_record.h"
#include "nadir/record/truth_plane_file.h"

namespace nadir::record {
namespace fs = std::filesystem;
namespace {

/// Frames that may wait to be written: enough to render one while another is compressed.
constexpr std::size_t most_pending = 2;

/// The files of a layer's frame, written.
Result<FrameFile> write_layer(const ImageFiles& images, const fs::path& folder, const render::FrameLayer& layer,
                              FrameFile file, bool mask) {
  const std::string stem = stem_of(file.vehicle, file.sensor, file.time_ns);
  file.file = stem + image_ending(layer);
  if (auto ok =
          images.write(folder / file.file, {layer.samples.data(), layer.type, layer.width, layer.height, layer.bands});
      !ok)
    return fail(ok);
  if (mask && layer.truth.valid_fraction < 1) {
    std::vector<std::uint8_t> grey(layer.validity.size());
    std::transform(layer.validity.begin(), layer.validity.end(), grey.begin(),
                   [](std::uint8_t v) { return v ? 255 : 0; });
    file.mask_file = stem + ".mask.png";
    if (auto ok =
            images.write(folder / file.mask_file, {grey.data(), tile::SampleType::UInt8, layer.width, layer.height, 1});
        !ok)
      return fail(ok);
  }
  return file;
}

/// Writes all files of a frame.
Result<FrameRecords> write_frame(const ImageFiles& images, const fs::path& folder, const render::Frame& frame,
                                 std::int64_t time_ns, const std::string& vehicle, bool masks,
                                 const std::optional<render::TruthPlanes>& planes) {
  std::string planes_file;
  if (planes) {
    planes_file = stem_of(vehicle, frame.layer().name, time_ns) + ".truth.tif";
    if (auto ok = write_truth_planes(folder / planes_file, *planes); !ok) return fail(ok);
  }
  FrameRecords records;
  for (const render::FrameLayer& layer : frame.layers()) {
    const auto file = write_layer(images, folder, layer, {{}, {}, planes_file, vehicle, layer.name, time_ns}, masks);
    if (!file) return fail(file);
    records.lines += frame_record(*file, layer) + "\n";
    records.features.push_back(footprint_feature(*file, layer));
  }
  return records;
}

}  // namespace

Result<void> clear_dataset(const fs::path& folder, bool force) {
  if (auto ok = refuse_to_overwrite(folder, force); !ok) return ok;
  std::error_code error;
  if (!fs::exists(folder / "frames.jsonl", error)) return {};  // somebody else's files stay
  for (const char* name : {"frames", "telemetry", "truth_rows", "pictures", "camera", "frames.jsonl",
                           "footprints.geojson", time_budgets_file, events_file, "report.html", "run.yaml"})
    fs::remove_all(folder / name, error);
  return {};
}

Result<Dataset> Dataset::create(const fs::path& folder, bool force) {
  if (auto ok = clear_dataset(folder, force); !ok) return fail(ok);
  std::error_code error;
  fs::create_directories(folder, error);
  if (error)
    return fail(Error::Kind::Io,
                fmt::format("{}: cannot make this folder: {}; choose another place", folder.string(), error.message()));
  Dataset dataset(folder);
  dataset.records_.reset(std::fopen((folder / "frames.jsonl").c_str(), "ab"));
  if (!dataset.records_)
    return fail(Error::Kind::Io,
                fmt::format("{}: cannot write: {}", (folder / "frames.jsonl").string(), std::strerror(errno)));
  std::setvbuf(dataset.records_.get(), nullptr, _IONBF,
               0);  // nothing of a record that failed is left to be written later
  auto footprints = FeatureFile::create(folder / "footprints.geojson");
  if (!footprints) return fail(footprints);
  dataset.footprints_.emplace(std::move(*footprints));
  return dataset;
}

Result<void> Dataset::add_camera(const std::string& vehicle, const render::Camera& camera) {
  return write_file(folder_ / "camera" / vehicle / (camera.name() + ".yaml"), camera.to_yaml());
}

Result<void> Dataset::write_time_budgets(const std::vector<std::string>& lines) {
  return write_file(folder_ / time_budgets_file, fmt::format("{}\n", fmt::join(lines, "\n")));
}

Result<void> Dataset::add(render::Frame frame, std::int64_t time_ns, const std::string& vehicle, bool masks,
                          std::optional<render::TruthPlanes> planes) {
  const auto images = image_files();
  if (!images) return fail(images);
  while (pending_.size() >= most_pending)
    if (auto ok = append_oldest(); !ok) return ok;
  pending_.push_back(std::async(std::launch::async, [images = *images, folder = folder_, frame = std::move(frame),
                                                     time_ns, vehicle, masks, planes = std::move(planes)] {
    return write_frame(*images, folder, frame, time_ns, vehicle, masks, planes);
  }));
  return {};
}

Result<void> Dataset::add_rejected(const std::vector<std::string>& sensors, std::int64_t time_ns,
                                   const std::string& vehicle, const std::string& reason) {
  std::string lines;
  for (const std::string& sensor : sensors)
    lines += rejected_frame_record({{}, {}, {}, vehicle, sensor, time_ns}, reason) + "\n";
  pending_.push_back(std::async(std::launch::deferred, [lines]() -> Result<FrameRecords> {
    return FrameRecords{lines, {}};
  }));
  return {};
}

Result<BandedFrame> Dataset::begin_bands(std::int64_t time_ns, const std::string& vehicle, bool masks) {
  const auto images = image_files();
  if (!images) return fail(images);
  return BandedFrame(**images, folder_, vehicle, time_ns, masks);
}

Result<void> Dataset::add(BandedFrame bands, const render::Frame& whole) {
  auto records = bands.finish(whole);
  if (!records) return fail(records);
  pending_.push_back(
      std::async(std::launch::deferred, [records = std::move(*records)]() -> Result<FrameRecords> { return records; }));
  return {};
}

Result<void> Dataset::append_oldest() {
  const Result<FrameRecords> written = pending_.front().get();
  pending_.pop_front();
  if (!written) return fail(written);
  const std::string& lines = written->lines;
  const fs::path records = folder_ / "frames.jsonl";
  if (std::fwrite(lines.data(), 1, lines.size(), records_.get()) == lines.size()) {
    records_bytes_ += lines.size();
    return footprints_->add(written->features);
  }
  const std::string reason = std::strerror(errno);
  std::error_code error;
  fs::resize_file(records, records_bytes_, error);  // a disk that is full took a part of the record
  return fail(Error::Kind::Io,
              fmt::format("{}: writing failed: {}; the frames listed so far are whole", records.string(), reason));
}

Result<void> Dataset::finish() {
  Result<void> first;
  while (!pending_.empty())
    if (auto ok = append_oldest(); !ok && first) first = ok;
  return first;
}

}  // namespace nadir::record
