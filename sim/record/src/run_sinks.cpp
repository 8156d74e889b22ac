#include "nadir/record/run_sinks.h"

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace nadir::record {
namespace fs = std::filesystem;
using geodesy::to_degrees;

Result<LineFile> LineFile::create(const fs::path& path, const std::string& header) {
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  LineFile file;
  file.path_ = path;
  file.file_.reset(std::fopen(path.c_str(), "wb"));
  if (!file.file_)
    return fail(Error::Kind::Io, fmt::format("{}: cannot write: {}", path.string(), std::strerror(errno)));
  if (!header.empty())
    if (auto ok = file.add(header); !ok) return fail(ok);
  return file;
}

Result<void> LineFile::add(const std::string& line) {
  if (std::fwrite(line.data(), 1, line.size(), file_.get()) == line.size() && std::fputc('\n', file_.get()) != EOF)
    return {};
  return fail(Error::Kind::Io, fmt::format("{}: writing failed: {}", path_.string(), std::strerror(errno)));
}

Result<void> LineFile::close() {
  if (std::fflush(file_.get()) == 0) return {};
  return fail(Error::Kind::Io, fmt::format("{}: writing failed: {}", path_.string(), std::strerror(errno)));
}

Result<void> FrameSink::on_frame(const sim::FrameEvent& event) {
  if (!event.frame) return dataset_.add_rejected({event.sensor}, event.state.time_ns, event.vehicle, event.rejected);
  const sim::PreparedSensor& sensor = run_.sensor(event.vehicle, event.sensor);
  std::optional<render::TruthPlanes> planes;
  if (run_.file().record_truth_planes) planes = render::truth_planes(sim::exact_chain(event.state, sensor), threads_);
  return dataset_.add(*event.frame, event.state.time_ns, event.vehicle, sensor.setup.off_map == render::OffMap::Mask,
                      std::move(planes));
}

namespace {

/// What a flown vehicle knows of itself, beside the channels of its kind; angles in degrees.
constexpr std::array flight_columns = {"velocity_north_mps",
                                       "velocity_east_mps",
                                       "velocity_down_mps",
                                       "p_dps",
                                       "q_dps",
                                       "r_dps",
                                       "specific_force_x_mps2",
                                       "specific_force_y_mps2",
                                       "specific_force_z_mps2",
                                       "airspeed_mps",
                                       "alpha_deg",
                                       "beta_deg",
                                       "throttle",
                                       "wind_north_mps",
                                       "wind_east_mps",
                                       "wind_down_mps",
                                       "commanded_up_m",
                                       "off_path_right_m",
                                       "off_path_above_m"};

std::array<double, flight_columns.size()> flight_values(const sim::FlightData& f) {
  return {f.velocity_ned_mps.x(),
          f.velocity_ned_mps.y(),
          f.velocity_ned_mps.z(),
          to_degrees(f.rates_radps.x()),
          to_degrees(f.rates_radps.y()),
          to_degrees(f.rates_radps.z()),
          f.specific_force_mps2.x(),
          f.specific_force_mps2.y(),
          f.specific_force_mps2.z(),
          f.airspeed_mps,
          to_degrees(f.alpha_rad),
          to_degrees(f.beta_rad),
          f.throttle,
          f.wind_ned_mps.x(),
          f.wind_ned_mps.y(),
          f.wind_ned_mps.z(),
          f.commanded_height_m,
          f.off_path_right_m,
          f.off_path_above_m};
}

}  // namespace

Result<LineFile*> TelemetrySink::file_of(const std::string& vehicle) {
  auto found = files_.find(vehicle);
  if (found == files_.end()) {
    std::string header = "time_ns,lat_deg,lon_deg,height_ellipsoid_m,east_m,north_m,up_m,yaw_deg,pitch_deg,roll_deg";
    for (const char* column : flight_columns) header += fmt::format(",{}", column);
    for (const std::string& channel : run_.vehicle(vehicle).source->channels()) header += "," + channel;
    auto file = LineFile::create(folder_ / "telemetry" / vehicle / "state.csv", header);
    if (!file) return fail(file);
    found = files_.emplace(vehicle, std::move(*file)).first;
  }
  return &found->second;
}

Result<void> TelemetrySink::on_state(const std::string& vehicle, const sim::VehicleState& state) {
  const auto file = file_of(vehicle);
  if (!file) return fail(file);
  const Eigen::Vector3d enu =
      (run_.ground().frame().enu_from_ecef() * geodesy::Point<geodesy::frame::Ecef>{state.ecef_from_body.origin}).xyz;
  std::string line = fmt::format("{},{},{},{},{},{},{},{},{},{}", state.time_ns, to_degrees(state.place.lat_rad),
                                 to_degrees(state.place.lon_rad), state.place.height_m, enu.x(), enu.y(), enu.z(),
                                 to_degrees(state.attitude.yaw_rad), to_degrees(state.attitude.pitch_rad),
                                 to_degrees(state.attitude.roll_rad));
  if (state.flight) {
    for (const double value : flight_values(*state.flight)) line += fmt::format(",{}", value);
    for (const double value : state.flight->channels) line += fmt::format(",{}", value);
  } else {
    line += std::string(flight_columns.size(), ',');  // a recorded vehicle knows its pose only
  }
  return (*file)->add(line);
}

Result<void> TelemetrySink::finish() {
  for (auto& [vehicle, file] : files_)
    if (auto ok = file.close(); !ok) return ok;
  return {};
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
