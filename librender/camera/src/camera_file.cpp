#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <vector>

#include "nadir/base/files.h"
#include "nadir/base/text.h"
#include "nadir/render/camera.h"

namespace nadir::render {
namespace {

/// A YAML map whose every key is known and whose every fault names file and line.
class CheckedMap {
 public:
  CheckedMap(const std::string& file, YAML::Node node) : file_(file), node_(std::move(node)) {}

  std::string where(const YAML::Node& node) const {
    return node.Mark().is_null() ? file_ : fmt::format("{}:{}", file_, node.Mark().line + 1);
  }

  Result<void> allow(std::span<const std::string_view> keys) const {
    if (!node_.IsMap()) return fail(Error::Kind::Malformed, fmt::format("{}: expected 'key: value' lines", where(node_)));
    for (const auto& entry : node_) {
      const std::string key = entry.first.as<std::string>("");
      if (std::find(keys.begin(), keys.end(), key) == keys.end())
        return fail(Error::Kind::Malformed, fmt::format("{}: unknown key '{}'{}", where(entry.first), key, suggestion(key, keys)));
    }
    return {};
  }

  bool has(const char* key) const { return static_cast<bool>(node_[key]); }

  template <class T>
  Result<T> get(const char* key, const char* expected) const {
    const YAML::Node value = node_[key];
    if (!value) return fail(Error::Kind::Malformed, fmt::format("{}: expected the key '{}'", where(node_), key));
    T result{};
    if (!YAML::convert<T>::decode(value, result))
      return fail(Error::Kind::Malformed, fmt::format("{}: '{}': expected {}", where(value), key, expected));
    return result;
  }

  /// A ROS matrix: rows, cols, data.
  Result<std::vector<double>> matrix(const char* key, int rows, int cols) const {
    const CheckedMap m(file_, node_[key]);
    static constexpr std::array<std::string_view, 3> keys = {"rows", "cols", "data"};
    if (auto ok = m.allow(keys); !ok) return fail(ok);
    auto data = m.get<std::vector<double>>("data", "a list of numbers");
    if (!data) return data;
    const bool any_length = cols == 0;
    const bool fits = any_length || data->size() == static_cast<std::size_t>(rows * cols);
    const bool finite = std::all_of(data->begin(), data->end(), [](double v) { return std::isfinite(v); });
    if (!fits || !finite)
      return fail(Error::Kind::Malformed, fmt::format("{}: '{}': expected {} finite numbers, found {}", where(m.node_), key,
                                                      any_length ? std::string("only") : std::to_string(rows * cols), data->size()));
    return data;
  }

  const YAML::Node& node() const { return node_; }

 private:
  const std::string& file_;
  YAML::Node node_;
};

Result<Camera> parse(const std::string& file, const YAML::Node& root) {
  static constexpr std::array<std::string_view, 8> keys = {"image_width", "image_height", "camera_name", "camera_matrix",
                                                           "distortion_model", "distortion_coefficients",
                                                           "rectification_matrix", "projection_matrix"};
  const CheckedMap map(file, root);
  if (auto ok = map.allow(keys); !ok) return fail(ok);
  const auto width = map.get<int>("image_width", "a number of pixels");
  if (!width) return fail(width);
  const auto height = map.get<int>("image_height", "a number of pixels");
  if (!height) return fail(height);
  if (!map.has("camera_matrix")) return fail(Error::Kind::Malformed, fmt::format("{}: expected the key 'camera_matrix'", file));
  const auto k = map.matrix("camera_matrix", 3, 3);
  if (!k) return fail(k);
  const std::vector<double>& m = *k;
  if (m[1] != 0 || m[3] != 0 || m[6] != 0 || m[7] != 0 || m[8] != 1)
    return fail(Error::Kind::Unsupported, fmt::format("{}: 'camera_matrix': expected [fx, 0, cx, 0, fy, cy, 0, 0, 1]", map.where(root["camera_matrix"])));

  if (map.has("distortion_coefficients")) {
    const auto d = map.matrix("distortion_coefficients", 0, 0);
    if (!d) return fail(d);
    if (std::any_of(d->begin(), d->end(), [](double v) { return v != 0; }))
      return fail(Error::Kind::Unsupported, fmt::format("{}: lens distortion is not modelled: rectify, and set the coefficients to 0",
                                                        map.where(root["distortion_coefficients"])));
  }
  if (map.has("rectification_matrix")) {
    const auto r = map.matrix("rectification_matrix", 3, 3);
    if (!r) return fail(r);
    if (*r != std::vector<double>{1, 0, 0, 0, 1, 0, 0, 0, 1})
      return fail(Error::Kind::Unsupported, fmt::format("{}: 'rectification_matrix': expected the identity: stereo rigs are two cameras",
                                                        map.where(root["rectification_matrix"])));
  }
  if (map.has("projection_matrix")) {  // of the rectified image, which is this one
    const auto p = map.matrix("projection_matrix", 3, 4);
    if (!p) return fail(p);
  }
  auto camera = Camera::pinhole(*width, *height, m[0], m[4], m[2] + 0.5, m[5] + 0.5);
  if (!camera) return fail(camera.error().kind, fmt::format("{}: {}", file, camera.error().message));
  if (map.has("camera_name")) camera->set_name(root["camera_name"].as<std::string>("camera"));
  return camera;
}

}  // namespace

Result<Camera> Camera::from_yaml(const std::filesystem::path& path) {
  const auto text = read_text_file(path);
  if (!text) return fail(text);
  try {  // yaml-cpp reports by exception
    return parse(path.string(), YAML::Load(*text));
  } catch (const YAML::Exception& e) {
    return fail(Error::Kind::Malformed, fmt::format("{}:{}: expected YAML: {}", path.string(), e.mark.line + 1, e.msg));
  }
}

std::string Camera::to_yaml() const {
  const Eigen::Matrix3d k = ros_camera_matrix();
  YAML::Emitter quoted_name;
  quoted_name << YAML::DoubleQuoted << name_;
  return fmt::format(
      "image_width: {}\nimage_height: {}\ncamera_name: {}\n"
      "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [{}, 0, {}, 0, {}, {}, 0, 0, 1]\n"
      "distortion_model: plumb_bob\n"
      "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0, 0, 0, 0, 0]\n"
      "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
      "projection_matrix:\n  rows: 3\n  cols: 4\n  data: [{}, 0, {}, 0, 0, {}, {}, 0, 0, 0, 1, 0]\n",
      width_px_, height_px_, quoted_name.c_str(), k(0, 0), k(0, 2), k(1, 1), k(1, 2), k(0, 0), k(0, 2), k(1, 1), k(1, 2));
}

}  // namespace nadir::render
