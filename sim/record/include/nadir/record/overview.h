#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/render/renderer.h"

namespace nadir::record {

/// Pictures of a dataset for people: a contact sheet of each layer, and the camera's path and footprints over each map.
///
/// Keeps poses, not images: the thumbnails and the maps below the footprints are rendered anew, small.
class Overview {
 public:
  /// `frames_to_come`: about as many calls of `add` as there will be; from them the frames shown are chosen evenly.
  Overview(const render::Scene& scene, const render::Camera& camera, std::size_t frames_to_come);

  /// The path as planned, north and east in the scene's tangent plane: drawn below the one flown.
  void plan(std::vector<Eigen::Vector2d> north_east_m);

  void add(const render::Truth& truth, std::int64_t time_ns);

  /// Thumbnails of a layer's frames.
  Result<void> write_contact_sheet(render::Renderer& renderer, const render::Layer& layer,
                                   const std::filesystem::path& path) const;
  /// The camera's path and the outlines of what it saw, over the layer's map.
  Result<void> write_footprints(render::Renderer& renderer, const render::Layer& layer,
                                const std::filesystem::path& path) const;

  const render::Scene& scene() const { return scene_; }

 private:
  struct Seen {
    std::int64_t time_ns;
    render::CameraPose ecef_from_camera;
    std::vector<Eigen::Vector2d> outline_m;  // east, north
  };

  render::Scene scene_;
  render::Camera camera_;
  std::size_t path_stride_, shown_stride_, added_ = 0;
  std::vector<Eigen::Vector2d> path_m_;  // east, north of the camera
  std::vector<Eigen::Vector2d> plan_m_;  // east, north
  std::vector<Seen> shown_;
};

}  // namespace nadir::record
