#include "exposure.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <type_traits>

namespace nadir::render {
namespace {

constexpr int most_instants = 4096;

/// The ray, in camera axes, towards what an image point sees from one pose, from another one.
Eigen::Vector3d ray_from(const CameraPose& there, const Surface& surface, const std::optional<Eigen::Vector3d>& ground,
                         const Eigen::Vector3d& ecef_direction) {
  if (!ground) return there.rotation.conjugate() * ecef_direction;
  const Eigen::Vector3d ecef = (surface.frame().ecef_from_enu() * geodesy::Point<geodesy::frame::Enu>{*ground}).xyz;
  return there.rotation.conjugate() * (ecef - there.origin);
}

template <class Visit>
void for_each_row(const FrameLayer& layer, Visit&& visit) {
  const auto width = static_cast<std::size_t>(layer.width);
  tbb::parallel_for(0, layer.height, [&](int y) {
    for (std::size_t i = static_cast<std::size_t>(y) * width, end = i + width; i < end; ++i) visit(i);
  });
}

}  // namespace

double motion_px(const Camera& camera, const CameraMotion& motion, const Shutter& shutter, const Surface& surface) {
  if (shutter.exposure_s == 0) return 0;
  const ExactChain chain(camera, motion, shutter, surface);
  constexpr int grid = 4, steps = 8;
  double greatest = 0;
  for (int j = 0; j <= grid; ++j) {
    for (int i = 0; i <= grid; ++i) {
      const Eigen::Vector2d image(camera.width_px() * (i / double{grid}), camera.height_px() * (j / double{grid}));
      const auto ray = camera.ray_of(image);
      if (!ray) continue;
      const auto ground = chain.enu_from_image(image);
      const Eigen::Vector3d direction = chain.ecef_from_camera_at(image.y()).rotation * *ray;
      const double row_s = shutter.readout_s * (image.y() / camera.height_px() - 0.5);
      double way = 0;
      std::optional<Eigen::Vector2d> before;
      for (int k = 0; k <= steps; ++k) {
        const CameraPose pose = motion.at(row_s + shutter.exposure_s * (k / double{steps} - 0.5));
        const auto at = camera.image_of(ray_from(pose, surface, ground, direction));
        if (at && before) way += (*at - *before).norm();
        before = at;
      }
      greatest = std::max(greatest, way);
    }
  }
  return greatest;
}

Result<std::vector<double>> exposure_instants_s(const Shutter& shutter, double motion_px, double step_px) {
  const double wanted = std::ceil(motion_px / step_px);
  if (!(wanted <= most_instants))
    return fail(
        Error::Kind::Malformed,
        fmt::format("exposure: in {} s what is seen goes {:.6g} px, more than the {} px that {} poses {} px apart "
                    "show: shorten the exposure, or check speeds and height",
                    shutter.exposure_s, motion_px, most_instants * step_px, most_instants, step_px));
  const int count = std::max(1, static_cast<int>(wanted));
  std::vector<double> instants;
  for (int i = 0; i < count; ++i) instants.push_back(shutter.exposure_s * ((i + 0.5) / count - 0.5));
  return instants;
}

Result<MovingExposure> moving_exposure(const Camera& camera, const CameraMotion& motion, const Shutter& shutter,
                                       const Surface& surface, double step_px) {
  Exposure exposure{.shutter = shutter};
  exposure.motion_px = motion_px(camera, motion, shutter, surface);
  const auto instants_s = exposure_instants_s(shutter, exposure.motion_px, step_px);
  if (!instants_s) return fail(instants_s);
  exposure.poses = static_cast<int>(instants_s->size());
  const double half_s = (shutter.exposure_s + shutter.readout_s) / 2;
  exposure.ecef_from_camera_at_start = motion.at(-half_s);
  exposure.ecef_from_camera_at_end = motion.at(half_s);
  std::vector<ExactChain> chains;
  for (const double of_exposure_s : *instants_s) chains.emplace_back(camera, motion, shutter, surface, of_exposure_s);
  return MovingExposure{exposure, {camera, motion, shutter, surface}, std::move(chains)};
}

MeanImage::MeanImage(const FrameLayer& layer, bool decibel)
    : decibel_(decibel),
      sums_(layer.validity.size() * static_cast<std::size_t>(layer.bands)),
      valid_(layer.validity.size()) {}

void MeanImage::add(const FrameLayer& layer) {
  ++images_;
  const auto bands = static_cast<std::size_t>(layer.bands);
  tile::with_sample_type(layer.type, [&]<class T>(T) {
    const T* samples = reinterpret_cast<const T*>(layer.samples.data());
    for_each_row(layer, [&](std::size_t i) {
      if (!layer.validity[i]) return;
      ++valid_[i];
      for (std::size_t b = i * bands; b < (i + 1) * bands; ++b) {
        const float value = static_cast<float>(samples[b]);
        sums_[b] += decibel_ ? std::pow(10.0f, value / 10) : value;
      }
    });
  });
}

void MeanImage::write(FrameLayer& layer) const {
  const auto bands = static_cast<std::size_t>(layer.bands);
  tile::with_sample_type(layer.type, [&]<class T>(T) {
    T* samples = reinterpret_cast<T*>(layer.samples.data());
    for_each_row(layer, [&](std::size_t i) {
      layer.validity[i] = 2 * valid_[i] >= images_ ? 1 : 0;
      for (std::size_t b = i * bands; b < (i + 1) * bands; ++b) {
        if (!layer.validity[i]) {
          samples[b] = T{};
          continue;
        }
        float mean = sums_[b] / static_cast<float>(valid_[i]);
        if (decibel_) mean = 10 * std::log10(mean);
        if constexpr (std::is_floating_point_v<T>)
          samples[b] = mean;
        else
          samples[b] = static_cast<T>(std::floor(mean + 0.5f));
      }
    });
  });
}

}  // namespace nadir::render
