#include "view.h"

#include <fmt/format.h>

#include "nadir/base/files.h"
#include "nadir/base/text.h"

namespace nadir::bench {

MapPoint map_point(const std::array<double, 9>& h, double u, double v) {
  const double w = 1 / (h[6] * u + h[7] * v + h[8]);
  const double x = (h[0] * u + h[1] * v + h[2]) * w, y = (h[3] * u + h[4] * v + h[5]) * w;
  return {x, y, (h[0] - x * h[6]) * w, (h[1] - x * h[7]) * w, (h[3] - y * h[6]) * w, (h[4] - y * h[7]) * w};
}

Result<void> write_views(const std::filesystem::path& path, const std::vector<View>& views) {
  std::string text;
  for (const View& view : views)
    text += fmt::format("{} {} {} {} {} {} {} {}\n", view.name, view.width, view.height, view.focal_px,
                        fmt::join(view.enu_from_camera, " "), fmt::join(view.camera_enu_m, " "),
                        fmt::join(view.map_pixel_from_image_pixel, " "), view.homography_error_px);
  return write_file(path, text);
}

Result<std::vector<View>> read_views(const std::filesystem::path& path) {
  const auto text = read_text_file(path);
  if (!text) return fail(text);
  std::vector<View> views;
  for (const std::string_view line : split(*text, '\n')) {
    if (line.empty()) continue;
    const auto words = split(line, ' ');
    std::vector<double> numbers;
    for (std::size_t i = 1; i < words.size(); ++i)
      if (const auto number = parse_number(words[i])) numbers.push_back(*number);
    if (words.size() != 26 || numbers.size() != 25)
      return fail(Error::Kind::Malformed,
                  fmt::format("{}: line {}: expected a name and 25 numbers", path.string(), views.size() + 1));
    View view{.name = std::string(words[0]),
              .width = static_cast<int>(numbers[0]),
              .height = static_cast<int>(numbers[1]),
              .focal_px = numbers[2],
              .homography_error_px = numbers[24]};
    std::copy_n(numbers.begin() + 3, 9, view.enu_from_camera.begin());
    std::copy_n(numbers.begin() + 12, 3, view.camera_enu_m.begin());
    std::copy_n(numbers.begin() + 15, 9, view.map_pixel_from_image_pixel.begin());
    views.push_back(std::move(view));
  }
  return views;
}

}  // namespace nadir::bench
