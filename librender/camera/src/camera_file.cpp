#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <vector>

#include "nadir/base/files.h"
#include "nadir/base/yaml.h"
#include "nadir/render/camera.h"

namespace nadir::render {
namespace {

/// The numbers of a ROS matrix (rows, cols, data); empty, with a fault noted, where it is not one of that many.
std::vector<double> read_matrix(const YamlMap& file, const char* key, std::optional<std::size_t> count) {
  const auto matrix = file.map(key);
  if (!matrix) return {};
  const auto rows = matrix->integer("rows"), cols = matrix->integer("cols");
  matrix->require("data");
  const auto data = matrix->numbers("data");
  if (!data) return {};
  if (count && data->size() != *count) {
    matrix->fault("data", fmt::format("expected {} finite numbers, found {}", *count, data->size()));
    return {};
  }
  if (rows && cols && static_cast<std::size_t>(*rows * *cols) != data->size())
    matrix->fault("data", fmt::format("expected {} by {} numbers, found {}", *rows, *cols, data->size()));
  return *data;
}

/// The lens; empty, with a fault noted, where the file tells none.
std::optional<Lens> read_lens(const YamlMap& file) {
  const std::string name = file.text("distortion_model").value_or("plumb_bob");
  const std::vector<double> coefficients = read_matrix(file, "distortion_coefficients", std::nullopt);
  const auto model = parse_lens_model(name);
  if (!model) {
    file.fault("distortion_model", model.error().message);
    return std::nullopt;
  }
  auto lens = Lens::make(*model, coefficients);
  if (!lens) {
    file.fault("distortion_coefficients", lens.error().message);
    return std::nullopt;
  }
  return std::move(*lens);
}

void refuse_rectification(const YamlMap& file) {
  const std::vector<double> rectification = read_matrix(file, "rectification_matrix", 9);
  if (!rectification.empty() && rectification != std::vector<double>{1, 0, 0, 0, 1, 0, 0, 0, 1})
    file.fault("rectification_matrix", "expected the identity: the cameras of a stereo rig are two cameras");
  read_matrix(file, "projection_matrix", 12);  // of the rectified image, which is not made here
}

}  // namespace

Result<Camera> Camera::from_yaml(const std::filesystem::path& path) {
  const auto text = read_text_file(path);
  if (!text) return fail(text);
  const auto file = YamlMap::parse(path.string(), *text);
  if (!file) return fail(file);
  for (const char* key : {"image_width", "image_height", "camera_matrix"}) file->require(key);
  const auto width = file->integer("image_width"), height = file->integer("image_height");
  const std::string name = file->text("camera_name").value_or("camera");
  const std::vector<double> k = read_matrix(*file, "camera_matrix", 9);
  if (!k.empty() && (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1))
    file->fault("camera_matrix", "expected [fx, 0, cx, 0, fy, cy, 0, 0, 1]");
  std::optional<Lens> lens = read_lens(*file);
  refuse_rectification(*file);
  if (auto ok = file->finish(); !ok) return fail(ok);

  const auto as_int = [](std::int64_t value) { return static_cast<int>(std::clamp<std::int64_t>(value, 0, 1 << 20)); };
  auto camera = Camera::pinhole(as_int(*width), as_int(*height), k[0], k[4], k[2] + 0.5, k[5] + 0.5);
  if (!camera) return fail(camera.error().kind, fmt::format("{}: {}", path.string(), camera.error().message));
  camera->set_name(name);
  return camera->with_lens(std::move(*lens));
}

std::string Camera::to_yaml() const {
  const Eigen::Matrix3d k = ros_camera_matrix();
  return fmt::format(
      "image_width: {}\nimage_height: {}\ncamera_name: {}\n"
      "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [{}, 0, {}, 0, {}, {}, 0, 0, 1]\n"
      "distortion_model: {}\n"
      "distortion_coefficients:\n  rows: 1\n  cols: {}\n  data: [{}]\n"
      "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
      "projection_matrix:\n  rows: 3\n  cols: 4\n  data: [{}, 0, {}, 0, 0, {}, {}, 0, 0, 0, 1, 0]\n",
      width_px_, height_px_, yaml_quoted(name_), k(0, 0), k(0, 2), k(1, 1), k(1, 2), to_string(lens_.model()),
      lens_.coefficients().size(), fmt::join(lens_.coefficients(), ", "), k(0, 0), k(0, 2), k(1, 1), k(1, 2));
}

}  // namespace nadir::render
