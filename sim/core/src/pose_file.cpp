#include "nadir/sim/pose_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "nadir/base/files.h"
#include "nadir/base/text.h"
#include "nadir/geodesy/height.h"

namespace nadir::sim {
namespace {

constexpr std::array<std::string_view, 7> vehicle_columns = {"t_s",     "lat_deg",   "lon_deg", "height_m",
                                                             "yaw_deg", "pitch_deg", "roll_deg"};
constexpr std::array<std::string_view, 8> camera_columns = {"t_s", "x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"};

/// One row's fields in the order of a table's columns.
class Row {
 public:
  Row(const std::string& file, int line, std::span<const std::string_view> columns,
      std::vector<std::string_view> fields)
      : file_(file), line_(line), columns_(columns), fields_(std::move(fields)) {}

  std::string where(std::size_t column) const { return fmt::format("{}:{}: {}", file_, line_, columns_[column]); }
  std::string_view text(std::size_t column) const { return fields_[column]; }

  Result<double> number(std::size_t column, double low = -1e12, double high = 1e12) const {
    const auto value = parse_number(fields_[column]);
    if (!value)
      return fail(Error::Kind::Malformed,
                  fmt::format("{}: expected a number, found '{}'", where(column), fields_[column]));
    if (*value < low || *value > high)
      return fail(Error::Kind::Malformed, fmt::format("{}: expected a value from {:g} to {:g}, found {}", where(column),
                                                      low, high, fields_[column]));
    return *value;
  }

  /// All columns from `first` on.
  Result<std::vector<double>> numbers(std::size_t first) const {
    std::vector<double> values;
    for (std::size_t i = first; i < columns_.size(); ++i) {
      const auto value = number(i);
      if (!value) return fail(value);
      values.push_back(*value);
    }
    return values;
  }

 private:
  const std::string& file_;
  int line_;
  std::span<const std::string_view> columns_;
  std::vector<std::string_view> fields_;
};

Result<render::CameraPose> vehicle_pose(const Row& row, const render::Surface& ground, const render::Mount& mount) {
  const auto lat = row.number(1, -90, 90), lon = row.number(2, -360, 360);
  const auto yaw = row.number(4), pitch = row.number(5), roll = row.number(6);
  for (const auto& value : {lat, lon, yaw, pitch, roll})
    if (!value) return fail(value);
  const auto typed = geodesy::parse_height(row.text(3));
  if (!typed) return fail(Error::Kind::Malformed, fmt::format("{}: {}", row.where(3), typed.error().message));
  const auto height_m =
      geodesy::ellipsoidal_height_m(*typed, geodesy::to_radians(*lat), geodesy::to_radians(*lon), ground.height_m());
  if (!height_m) return fail(height_m);
  return render::camera_pose(geodesy::Geodetic::degrees(*lat, *lon, *height_m),
                             geodesy::YawPitchRoll::degrees(*yaw, *pitch, *roll), mount);
}

Result<render::CameraPose> direct_pose(const Row& row, const render::Surface& ground) {
  const auto values = row.numbers(1);
  if (!values) return fail(values);
  const std::vector<double>& v = *values;
  const Eigen::Quaterniond rotation(v[6], v[3], v[4], v[5]);
  if (std::abs(rotation.norm() - 1) > 1e-3)
    return fail(Error::Kind::Malformed, fmt::format("{}: expected a unit quaternion, found one of length {:.6g}",
                                                    row.where(4), rotation.norm()));
  const geodesy::Pose<geodesy::frame::Enu, geodesy::frame::Camera> enu_from_camera{rotation.normalized(),
                                                                                   {v[0], v[1], v[2]}};
  return ground.frame().ecef_from_enu() * enu_from_camera;
}

/// Which field of a line holds each column; the header has just these columns in any order.
Result<std::vector<std::size_t>> order_of(const std::string& where, const std::vector<std::string_view>& header,
                                          std::span<const std::string_view> columns) {
  std::vector<std::size_t> order(columns.size(), header.size());
  for (std::size_t i = 0; i < header.size(); ++i) {
    const auto at = std::find(columns.begin(), columns.end(), header[i]);
    if (at == columns.end())
      return fail(Error::Kind::Malformed,
                  fmt::format("{}: unknown column '{}'{}", where, header[i], suggestion(header[i], columns)));
    auto& slot = order[static_cast<std::size_t>(at - columns.begin())];
    if (slot != header.size())
      return fail(Error::Kind::Malformed, fmt::format("{}: the column '{}' is there twice", where, header[i]));
    slot = i;
  }
  for (std::size_t c = 0; c < columns.size(); ++c)
    if (order[c] == header.size())
      return fail(Error::Kind::Malformed, fmt::format("{}: the column '{}' is missing; expected {}", where, columns[c],
                                                      fmt::join(columns, ",")));
  return order;
}

}  // namespace

Result<std::vector<TimedPose>> read_pose_file(const std::filesystem::path& path, const render::Surface& ground,
                                              const render::Mount& mount) {
  const auto text = read_text_file(path);
  if (!text) return fail(text);
  const std::string file = path.string();

  std::vector<TimedPose> poses;
  std::span<const std::string_view> columns;
  std::vector<std::size_t> order;
  int line_number = 0;
  for (std::string_view line : split(*text, '\n')) {
    ++line_number;
    if (line.empty() || line.front() == '#') continue;
    const std::vector<std::string_view> fields = split(line, ',');
    const std::string where = fmt::format("{}:{}", file, line_number);
    if (columns.empty()) {  // the header tells which of the two kinds it is
      const bool direct =
          std::any_of(fields.begin(), fields.end(), [](std::string_view f) { return f == "qw" || f == "qx"; });
      columns = direct ? std::span<const std::string_view>(camera_columns)
                       : std::span<const std::string_view>(vehicle_columns);
      auto found = order_of(where, fields, columns);
      if (!found) return fail(found);
      order = std::move(*found);
      continue;
    }
    if (fields.size() != columns.size())
      return fail(Error::Kind::Malformed,
                  fmt::format("{}: expected {} fields, found {}", where, columns.size(), fields.size()));
    std::vector<std::string_view> ordered;
    for (const std::size_t i : order) ordered.push_back(fields[i]);
    const Row row(file, line_number, columns, std::move(ordered));

    const auto time_ns = parse_seconds_as_ns(row.text(0));
    if (!time_ns) return fail(Error::Kind::Malformed, fmt::format("{}: {}", row.where(0), time_ns.error().message));
    if (!poses.empty() && *time_ns <= poses.back().time_ns)
      return fail(
          Error::Kind::Malformed,
          fmt::format("{}: expected times to rise, found {} after an equal or later one", row.where(0), row.text(0)));
    const auto pose =
        columns.size() == camera_columns.size() ? direct_pose(row, ground) : vehicle_pose(row, ground, mount);
    if (!pose) return fail(pose);
    poses.push_back({*time_ns, *pose});
  }
  if (poses.empty())
    return fail(Error::Kind::Malformed, fmt::format("{}: expected poses, found none; its header is {} or {}", file,
                                                    fmt::join(vehicle_columns, ","), fmt::join(camera_columns, ",")));
  return poses;
}

}  // namespace nadir::sim
