// GDAL's warper with a transformer of its own for the homography, within GDAL's usual eighth of a pixel. Methods:
// "bilinear", "average"; from the level that `gdalwarp -ovr AUTO` takes, which is never coarser than a pixel.
#include <gdalwarper.h>

#include <Eigen/LU>

#include "gdal_levels.h"

namespace nadir::bench {
namespace {

using Homography = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// Between raster coordinates of the level and of the frame, whose first pixels have their corners at (0, 0).
struct Transformer {
  Homography level_from_frame, frame_from_level;
};
int transform(void* of, int to_frame_inverse, int count, double* x, double* y, double*, int* success) {
  const auto& t = *static_cast<const Transformer*>(of);
  const Homography& h = to_frame_inverse ? t.level_from_frame : t.frame_from_level;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d at = h * Eigen::Vector3d(x[i], y[i], 1);
    success[i] = at.z() != 0;
    x[i] = at.x() / at.z();
    y[i] = at.y() / at.z();
  }
  return TRUE;
}

class Warp : public Peer {
 public:
  static Result<std::unique_ptr<Peer>> open(const PeerSetup& setup) {
    auto map = GdalLevels::open(setup.maps[0]);
    if (!map) return fail(map);
    auto peer = std::make_unique<Warp>(std::move(*map));
    if (setup.method != "bilinear" && setup.method != "average")
      return fail(Error::Kind::NotFound, "no method '" + setup.method + "'");
    peer->resampling_ = setup.method == "average" ? GRA_Average : GRA_Bilinear;
    peer->threads_ = setup.threads;
    GDALRegister_MEM();
    return peer;
  }
  explicit Warp(GdalLevels map) : map_(std::move(map)) {}

  Result<void> render(const View& view) override {
    const int bands = map_.bands(), texel = map_.texel_bytes(), sample = texel / bands;
    frame_.resize(static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height * texel));
    // The frame as a dataset
    GDALDriver* const memory = GetGDALDriverManager()->GetDriverByName("MEM");
    const std::unique_ptr<GDALDataset> frame(memory->Create("", view.width, view.height, 0, map_.type(), nullptr));
    for (int b = 0; b < bands; ++b) {
      std::array<char, 64> pointer{};
      pointer[static_cast<std::size_t>(CPLPrintPointer(pointer.data(), frame_.data() + b * sample, 63))] = 0;
      const std::string data = std::string("DATAPOINTER=") + pointer.data(),
                        pixel = "PIXELOFFSET=" + std::to_string(texel),
                        line = "LINEOFFSET=" + std::to_string(texel * view.width);
      const char* const options[] = {data.c_str(), pixel.c_str(), line.c_str(), nullptr};
      frame->AddBand(map_.type(), const_cast<char**>(options));
    }

    const MapPoint middle = map_point(view.map_pixel_from_image_pixel, view.width / 2.0, view.height / 2.0);
    int level = 0;
    while (level + 1 < map_.count() && map_.texels_x(level + 1) < footprint_texels(middle) * 1.01) ++level;
    Homography corner_from_centre, level_from_texel;
    corner_from_centre << 1, 0, 0.5, 0, 1, 0.5, 0, 0, 1;
    level_from_texel << 1 / map_.texels_x(level), 0, 0, 0, 1 / map_.texels_y(level), 0, 0, 0, 1;
    Transformer transformer;
    transformer.level_from_frame = level_from_texel * corner_from_centre *
                                   Eigen::Map<const Homography>(view.map_pixel_from_image_pixel.data()) *
                                   corner_from_centre.inverse();
    transformer.frame_from_level = transformer.level_from_frame.inverse();
    struct Destroy {
      void operator()(void* t) const { GDALDestroyApproxTransformer(t); }
      void operator()(GDALWarpOptions* o) const { GDALDestroyWarpOptions(o); }
    };
    const std::unique_ptr<void, Destroy> approximate(GDALCreateApproxTransformer(transform, &transformer, 0.125));

    const std::unique_ptr<GDALWarpOptions, Destroy> options(GDALCreateWarpOptions());
    options->hSrcDS = &map_.dataset(level);
    options->hDstDS = frame.get();
    options->eResampleAlg = resampling_;
    options->dfWarpMemoryLimit = static_cast<double>(peer_cache_bytes);
    options->nBandCount = bands;
    options->panSrcBands = static_cast<int*>(CPLMalloc(sizeof(int) * static_cast<std::size_t>(bands)));
    options->panDstBands = static_cast<int*>(CPLMalloc(sizeof(int) * static_cast<std::size_t>(bands)));
    for (int b = 0; b < bands; ++b) options->panSrcBands[b] = options->panDstBands[b] = b + 1;
    options->pfnTransformer = GDALApproxTransform;
    options->pTransformerArg = approximate.get();
    options->papszWarpOptions = CSLSetNameValue(options->papszWarpOptions, "INIT_DEST", "0");
    options->papszWarpOptions =
        CSLSetNameValue(options->papszWarpOptions, "NUM_THREADS", std::to_string(threads_).c_str());
    GDALWarpOperation operation;
    if (operation.Initialize(options.get()) != CE_None ||
        operation.ChunkAndWarpImage(0, 0, view.width, view.height) != CE_None)
      return fail(Error::Kind::Io, std::string("GDAL cannot warp: ") + CPLGetLastErrorMsg());
    frame->FlushCache();
    return {};
  }
  std::span<const std::byte> samples() const override { return frame_; }

 private:
  GdalLevels map_;
  GDALResampleAlg resampling_ = GRA_Bilinear;
  int threads_ = 1;
  std::vector<std::byte> frame_;
};

}  // namespace
}  // namespace nadir::bench

int main(int argc, char** argv) { return nadir::bench::run_peer(argc, argv, nadir::bench::Warp::open); }
