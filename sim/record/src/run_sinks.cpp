#include "nadir/record/run_sinks.h"

#include <fmt/format.h>

namespace nadir::record {

Result<void> FrameSink::on_frame(const sim::FrameEvent& event) {
  if (!event.frame) return dataset_.add_rejected({event.sensor}, event.state.time_ns, event.vehicle, event.rejected);
  const sim::PreparedSensor& sensor = run_.sensor(event.vehicle, event.sensor);
  std::optional<render::TruthPlanes> planes;
  if (run_.file().record_truth_planes) planes = render::truth_planes(sim::exact_chain(event.state, sensor), threads_);
  return dataset_.add(*event.frame, event.state.time_ns, event.vehicle, sensor.setup.off_map == render::OffMap::Mask,
                      std::move(planes));
}

Result<void> TruthRowSink::on_frame(const sim::FrameEvent& event) {
  const std::string name = event.vehicle + "/" + event.sensor;
  auto found = rows_.find(name);
  if (found == rows_.end()) {
    auto file = LineFile::create(folder_ / "truth_rows" / (name + ".txt"), "");
    if (!file) return fail(file);
    found = rows_.emplace(name, Rows{std::move(*file)}).first;
  }
  const std::int64_t number = found->second.frames++;
  if (!event.frame || !event.frame->truth().map_pixel_from_image_pixel) return {};
  const render::Truth& truth = event.frame->truth();

  Eigen::Matrix4d pose = Eigen::Matrix4d::Identity();
  const Eigen::Matrix3d half_turn = Eigen::Vector3d(-1, -1, 1).asDiagonal();
  pose.topLeftCorner<3, 3>() = half_turn * truth.enu_from_camera.rotation.toRotationMatrix().transpose();
  pose.topRightCorner<3, 1>() = truth.enu_from_camera.origin;
  std::string line = std::to_string(number);
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) line += fmt::format(" {}", pose(r, c));
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) line += fmt::format(" {}", (*truth.map_pixel_from_image_pixel)(r, c));
  for (const std::size_t corner : {0, 1, 3, 2})
    line += fmt::format(" {} {}", truth.footprint_texel[corner]->x() - 0.5, truth.footprint_texel[corner]->y() - 0.5);
  return found->second.file.add(line);
}

Result<void> TruthRowSink::finish() {
  for (auto& [name, rows] : rows_)
    if (auto ok = rows.file.close(); !ok) return ok;
  return {};
}

}  // namespace nadir::record
