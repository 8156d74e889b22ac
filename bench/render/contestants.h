#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nadir/bench/runner.h"
#include "peer_process.h"
#include "scenery.h"

namespace nadir::bench {

/// A way to render: a program and one of its methods.
struct Contestant {
  std::string name;  // "GDAL + OpenCV linear"
  std::string program, method;
  bool texture = false;  // takes the map that is marked as one
  bool ours() const { return program == "nadir-peer-nadir"; }
};

/// Nadir's settings and all peers.
std::vector<Contestant> contestants();
/// Those of the names, in their order.
std::vector<Contestant> contestants(const std::vector<std::string>& names);

std::string threads_setting(int threads);  // "1 thread"

/// Frames of one view by all contestants, against what the view ought to show.
struct ViewSetting {
  View view;
  std::shared_ptr<const Scenery> scenery;
  std::string map, texture;  // the map, and the same content marked as texture
  std::filesystem::path views;
  int index = 0;  // of the view in that file
  std::filesystem::path scratch;
  Ideal ideal;
};

/// The setting of a pose: maps, ideal, and the view in a file of its own. `budget`: samples of the map for the ideal.
Result<std::shared_ptr<const ViewSetting>> setting_of(const RunOptions& options,
                                                      const std::shared_ptr<const Scenery>& scenery, const Pose& pose,
                                                      int width, int height, const std::string& codec, double budget);

/// A started contestant as a method that tells error and PSNR; left out where its program is missing or refuses the
/// map.
Method method_of(const std::shared_ptr<const ViewSetting>& setting, const Contestant& contestant, int threads);

/// Errors of a frame as counters and as the row's.
struct FrameErrors {
  Deviation scene, image;
};
FrameErrors errors_of(const ViewSetting& setting, std::span<const std::byte> frame);

}  // namespace nadir::bench
