#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "maps.h"
#include "must.h"
#include "nadir/record/image_files.h"
#include "nadir/render/renderer.h"
#include "original.h"
#include "sections.h"

namespace nadir::bench {
namespace {

constexpr int width_px = 400, height_px = 300, poses = 20;
constexpr double focal_px = 400, minification = 3.8, yaw_deg = 33;
/// By what the picture moves between two frames: no whole number, so each frame samples other points of the ground.
const Eigen::Vector2d motion_px(1.84, 1.38);

using Pixels = std::vector<std::uint8_t>;  // red, green, blue

Pixels rgb(const cv::Mat& bgr) {
  Pixels out;
  out.reserve(bgr.total() * 3);
  for (int y = 0; y < bgr.rows; ++y)
    for (int x = 0; x < bgr.cols; ++x)
      for (const int band : {2, 1, 0}) out.push_back(bgr.at<cv::Vec3b>(y, x)[band]);
  return out;
}

/// Mean square of what a picture shows otherwise than the one before, moved along by Lanczos interpolation.
double squares_of_change(const Pixels& before, const Pixels& now) {
  constexpr int border = 8;  // of the interpolation, and of what moves in
  const auto floats = [](const Pixels& pixels) {
    cv::Mat out;
    cv::Mat(height_px, width_px, CV_8UC3, const_cast<std::uint8_t*>(pixels.data())).convertTo(out, CV_32FC3);
    return out;
  };
  const cv::Mat to_now = (cv::Mat_<double>(2, 3) << 1, 0, motion_px.x(), 0, 1, motion_px.y());
  cv::Mat moved;
  cv::warpAffine(floats(before), moved, to_now, {width_px, height_px}, cv::INTER_LANCZOS4);
  const cv::Rect inner(border, border, width_px - 2 * border, height_px - 2 * border);
  return std::pow(cv::norm(moved(inner), floats(now)(inner), cv::NORM_L2), 2) / (3 * inner.area());
}

/// One method along a flight.
struct Errors {
  std::string name;
  double squares = 0, magnitudes = 0, changes = 0;  // sums over frames of their means
  int frames = 0;
  Pixels first, last;

  void add(Pixels picture, const Pixels& reference) {
    const auto samples = static_cast<double>(picture.size());
    for (std::size_t i = 0; i < picture.size(); ++i) {
      const int error = picture[i] - reference[i];
      squares += error * error / samples;
      magnitudes += std::abs(error) / samples;
    }
    if (frames++ == 0)
      first = picture;
    else
      changes += squares_of_change(last, picture);
    last = std::move(picture);
  }

  std::string row() const {
    const double mse = squares / frames;
    return fmt::format("| {} | {} | {:.2f} | {:.2f} | {:.2f} |\n", name,
                       mse > 0 ? fmt::format("{:.1f}", 10 * std::log10(255 * 255 / mse)) : "", std::sqrt(mse),
                       magnitudes / frames, std::sqrt(changes / (frames - 1)));
  }
};

/// 90x67 pixels from the picture's middle, each as 4x4.
record::Image enlarged(const Pixels& picture) {
  constexpr int cols = 90, rows = 67, times = 4, left = (width_px - cols) / 2, top = (height_px - rows) / 2;
  record::Image out{{}, tile::SampleType::UInt8, cols * times, rows * times, 3};
  for (int y = 0; y < rows * times; ++y)
    for (int x = 0; x < cols * times; ++x)
      for (int band = 0; band < 3; ++band)
        out.samples.push_back(static_cast<std::byte>(
            picture[static_cast<std::size_t>(3 * ((top + y / times) * width_px + left + x / times) + band)]));
  return out;
}

/// Grey where a picture is right, four times as far from grey as it errs.
Pixels amplified(const Pixels& picture, const Pixels& reference) {
  Pixels out(picture.size());
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = static_cast<std::uint8_t>(std::clamp(128 + 4 * (picture[i] - reference[i]), 0, 255));
  return out;
}

void draw(const std::filesystem::path& path, const Pixels& reference, const Errors& original, const Errors& balanced,
          const Errors& best) {
  const std::vector<std::pair<std::string, Pixels>> pictures = {
      {"reference: the mean under each pixel", reference},
      {"original, half-pixel shifts undone", original.first},
      {"ours: balanced", balanced.first},
      {"ours: best", best.first},
      {"original less reference, x 4", amplified(original.first, reference)},
      {"ours, balanced, less reference, x 4", amplified(balanced.first, reference)},
  };
  std::vector<record::Image> images;
  for (const auto& [caption, pixels] : pictures) images.push_back(enlarged(pixels));
  record::ContactSheet sheet{"Kampala at a minification of 3.8, 90 x 67 pixels at 400 %", {}};
  for (std::size_t i = 0; i < images.size(); ++i)
    sheet.frames.push_back({.image = images[i].view(), .caption = pictures[i].first});
  must(must(record::image_files())->write_contact_sheet(path, sheet));
}

}  // namespace

std::string aliasing_section(const std::filesystem::path& work, const std::filesystem::path& picture) {
  const tile::Map map = kampala_without_loss(work);
  const auto scene = render::Scene::plane(map.center(), {}).with_layer("eo", map, {.bands = {1, 2, 3}});
  const auto camera =
      must(render::Camera::pinhole(width_px, height_px, focal_px, focal_px, width_px / 2.0, height_px / 2.0));
  const Original original(read_bgr(map), plane_of_map_units(map));
  const double gsd_m = minification * map.texel_size_m().x(), height_m = gsd_m * focal_px;
  render::Renderer renderer;

  Errors definition{.name = "reference"}, as_is{.name = "original"},
      aligned{.name = "original, its half-pixel shifts undone"}, draft{.name = "ours, draft"},
      balanced{.name = "ours, balanced"}, best{.name = "ours, best"};
  EnuFromCamera enu_from_camera = level(0, 0, height_m);
  enu_from_camera.rotation *=
      Eigen::Quaterniond(Eigen::AngleAxisd(geodesy::to_radians(yaw_deg), Eigen::Vector3d::UnitZ()));
  // The ground moves right and down in the picture where the camera moves left and up in it.
  const Eigen::Vector3d step_m = enu_from_camera.rotation * Eigen::Vector3d(-motion_px.x(), -motion_px.y(), 0) * gsd_m;
  enu_from_camera.origin -= step_m * (poses / 2);
  for (int i = 0; i < poses; ++i, enu_from_camera.origin += step_m) {
    const auto pose = scene.surface().frame().ecef_from_enu() * enu_from_camera;
    const auto render = [&](const render::RenderOptions& options) {
      return must(renderer.render(scene, camera, pose, options));
    };
    const auto pixels = [](const render::Frame& frame) {
      const auto samples = frame.pixels<std::uint8_t>();
      return Pixels(samples.begin(), samples.end());
    };
    const auto frame = render({.filter = render::Filter::Reference});
    if (frame.truth().valid_fraction < 1)
      must(Result<void>(fail(Error::Kind::OutsideMap, "kampala.tif: this flight needs ground everywhere")));
    const Pixels reference = pixels(frame);
    definition.add(reference, reference);

    const auto& texel = frame.truth().footprint_texel;
    std::array<Eigen::Vector2d, 4> corners = {*texel[0], *texel[1], *texel[3], *texel[2]};
    as_is.add(rgb(original.picture(Original::sensor_from_reference(corners, Original::its_rectangle(camera)), camera)),
              reference);
    for (Eigen::Vector2d& corner : corners) corner.array() -= 0.5;
    aligned.add(
        rgb(original.picture(Original::sensor_from_reference(corners, {-0.5F, -0.5F, width_px, height_px}), camera)),
        reference);
    draft.add(pixels(render({.quality = render::Quality::draft})), reference);
    balanced.add(pixels(render({.quality = render::Quality::balanced})), reference);
    best.add(pixels(render({.quality = render::Quality::best})), reference);
  }

  std::string text = fmt::format(
      "## Aliasing\n\n{} frames of {} x {} pixels over kampala.tif (without alpha, its levels built without loss) at a "
      "minification of {}, against the reference filter (the mean of the "
      "bilinear map under each pixel), in grey levels. Flicker: RMS difference of consecutive frames after the "
      "picture's motion of {:.1f} "
      "pixels is undone.\n\n"
      "| | PSNR (dB) | RMS error | mean error | flicker |\n| --- | --- | --- | --- | --- |\n",
      poses, width_px, height_px, minification, motion_px.norm());
  for (const Errors* errors : {&definition, &as_is, &aligned, &draft, &balanced, &best}) text += errors->row();
  if (record::image_files())
    draw(picture, definition.first, aligned, balanced, best);
  else
    text += "\nNo picture: built without image files.\n";
  return text;
}

}  // namespace nadir::bench
