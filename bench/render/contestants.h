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
  bool texture = false;     // takes the map that is marked as one
  bool two_layers = false;  // takes the second map too
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
  std::string second;        // the same content in another file; empty where no contestant takes it
  std::filesystem::path views;
  int index = 0;  // of the view in that file
  std::filesystem::path scratch;
  Ideal ideal;
};

/// The setting of a pose: maps, ideal, and the view in a file of its own. `budget`: samples of the map for the ideal.
Result<std::shared_ptr<ViewSetting>> setting_of(const RunOptions& options,
                                                const std::shared_ptr<const Scenery>& scenery, const Pose& pose,
                                                int width, int height, const std::string& codec, double budget);

/// What starts a contestant.
PeerCommand command_of(const ViewSetting& setting, const Contestant& contestant, int threads);

/// A started contestant; an error where its program is missing or refuses the map.
Result<std::shared_ptr<PeerProcess>> start(const ViewSetting& setting, const Contestant& contestant, int threads);

/// A contestant as a method that tells error and PSNR; left out where it cannot be started. `keep`, if there, is given
/// its last frame.
Method method_of(const std::shared_ptr<const ViewSetting>& setting, const Contestant& contestant, int threads,
                 const std::function<void(std::string frame)>& keep = {});

/// Errors of a frame as counters and as the row's.
struct FrameErrors {
  Deviation scene, image;
};
FrameErrors errors_of(const ViewSetting& setting, std::span<const std::byte> frame);

}  // namespace nadir::bench
