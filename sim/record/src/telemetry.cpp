#include "nadir/record/telemetry.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cassert>

namespace nadir::record {
namespace fs = std::filesystem;
using geodesy::to_degrees;

static_assert(std::endian::native == std::endian::little, "arrays are written as they lie in memory");

namespace {

constexpr std::array pose_columns = {"lat_deg", "lon_deg", "height_ellipsoid_m", "east_m",  "north_m",
                                     "up_m",    "yaw_deg", "pitch_deg",          "roll_deg"};

/// What every flown vehicle knows of itself.
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

std::array<double, pose_columns.size()> pose_values(const sim::VehicleState& state, const geodesy::LocalFrame& scene) {
  const Eigen::Vector3d enu =
      (scene.enu_from_ecef() * geodesy::Point<geodesy::frame::Ecef>{state.ecef_from_body.origin}).xyz;
  return {to_degrees(state.place.lat_rad),
          to_degrees(state.place.lon_rad),
          state.place.height_m,
          enu.x(),
          enu.y(),
          enu.z(),
          to_degrees(state.attitude.yaw_rad),
          to_degrees(state.attitude.pitch_rad),
          to_degrees(state.attitude.roll_rad)};
}

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

/// All that is known of a state, in the order of its columns; of a recorded vehicle its pose only.
std::vector<double> values_of(const sim::VehicleState& state, const geodesy::LocalFrame& scene) {
  const auto pose = pose_values(state, scene);
  std::vector<double> values(pose.begin(), pose.end());
  if (state.flight) {
    const auto flight = flight_values(*state.flight);
    values.insert(values.end(), flight.begin(), flight.end());
    values.insert(values.end(), state.flight->channels.begin(), state.flight->channels.end());
  }
  return values;
}

std::vector<std::string> columns(bool flown, std::span<const std::string> channels) {
  std::vector<std::string> names(pose_columns.begin(), pose_columns.end());
  if (flown) {
    names.insert(names.end(), flight_columns.begin(), flight_columns.end());
    names.insert(names.end(), channels.begin(), channels.end());
  }
  return names;
}

}  // namespace

std::string NpyFile::header() const {
  std::string dictionary = fmt::format("{{'descr': [{}], 'fortran_order': False, 'shape': ({},), }}", fields_, rows_);
  // The same length whatever the count, which has at most 20 digits
  const std::string count = std::to_string(rows_);
  dictionary += std::string(20 - count.size(), ' ');
  const std::size_t prefix = 10;
  dictionary += std::string(63 - (prefix + dictionary.size()) % 64, ' ') + "\n";
  std::string header("\x93NUMPY\x01\x00", 8);
  header += static_cast<char>(dictionary.size() & 0xff);
  header += static_cast<char>(dictionary.size() >> 8);
  return header + dictionary;
}

Result<NpyFile> NpyFile::create(const fs::path& path, const std::string& time_name,
                                const std::vector<std::string>& names) {
  NpyFile file;
  file.path_ = path;
  file.fields_ = fmt::format("('{}', '<i8')", time_name);
  for (const std::string& name : names) file.fields_ += fmt::format(", ('{}', '<f8')", name);
  file.columns_ = names.size();
  if (file.fields_.size() > 60'000)
    return fail(Error::Kind::Unsupported, fmt::format("{}: too many columns for this format", path.string()));
  auto opened = create_file(path);
  if (!opened) return fail(opened);
  file.file_ = std::move(*opened);
  const std::string header = file.header();
  if (std::fwrite(header.data(), 1, header.size(), file.file_.get()) != header.size())
    return tl::unexpected(write_error(path));
  return file;
}

Result<void> NpyFile::add(std::int64_t time, std::span<const double> values) {
  assert(values.size() == columns_);
  ++rows_;
  if (std::fwrite(&time, sizeof(time), 1, file_.get()) == 1 &&
      std::fwrite(values.data(), sizeof(double), values.size(), file_.get()) == values.size())
    return {};
  return tl::unexpected(write_error(path_));
}

Result<void> NpyFile::close() {
  const std::string now = header();
  if (std::fseek(file_.get(), 0, SEEK_SET) == 0 && std::fwrite(now.data(), 1, now.size(), file_.get()) == now.size() &&
      std::fflush(file_.get()) == 0)
    return {};
  return tl::unexpected(write_error(path_));
}

Result<void> TelemetrySink::on_state(const std::string& vehicle, const sim::VehicleState& state) {
  const fs::path folder = folder_ / "telemetry" / vehicle;
  const auto channels = run_.vehicle(vehicle).source->channels();
  const std::vector<double> values = values_of(state, run_.ground().frame());
  if (run_.file().telemetry == sim::TelemetryFormat::Npy) {
    auto found = arrays_.find(vehicle);
    if (found == arrays_.end()) {
      auto file = NpyFile::create(folder / "state.npy", "time_ns", columns(state.flight.has_value(), channels));
      if (!file) return fail(file);
      found = arrays_.emplace(vehicle, std::move(*file)).first;
    }
    return found->second.add(state.time_ns, values);
  }
  auto found = lines_.find(vehicle);
  const std::vector<std::string> names = columns(true, channels);
  if (found == lines_.end()) {
    auto file = LineFile::create(folder / "state.csv", fmt::format("time_ns,{}", fmt::join(names, ",")));
    if (!file) return fail(file);
    found = lines_.emplace(vehicle, std::move(*file)).first;
  }
  std::string line = fmt::format("{},{}", state.time_ns, fmt::join(values, ","));
  line += std::string(names.size() - values.size(), ',');
  return found->second.add(line);
}

Result<void> TelemetrySink::finish() {
  for (auto& [vehicle, file] : lines_)
    if (auto ok = file.close(); !ok) return ok;
  for (auto& [vehicle, file] : arrays_)
    if (auto ok = file.close(); !ok) return ok;
  return {};
}

}  // namespace nadir::record
