// GDAL's warper with a transformer of its own for the homography, within GDAL's usual eighth of a pixel. Methods:
// "bilinear", "average"; from the level that `gdalwarp -ovr AUTO` takes, which is never coarser than a pixel.
#include <gdalwarper.h>

#include <Eigen/LU>
#include <array>

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
    if (setup.method != "bilinear" && setup.method != "average")
      return fail(Error::Kind::NotFound, "no method '" + setup.method + "'");
    auto peer = std::make_unique<Warp>();
    for (int i = 0; i < setup.threads; ++i) {  // a dataset serves one thread at a time
      auto map = GdalLevels::open(setup.maps[0]);
      if (!map) return fail(map);
      peer->maps_.push_back(std::move(*map));
    }
    peer->resampling_ = setup.method == "average" ? GRA_Average : GRA_Bilinear;
    GDALRegister_MEM();
    return peer;
  }

  Result<void> render(const View& view) override {
    frame_.resize(static_cast<std::size_t>(view.width) *
                  static_cast<std::size_t>(view.height * maps_[0].texel_bytes()));
    // GDAL's own threads take only transformers that it made itself
    const int threads = static_cast<int>(maps_.size());
    std::vector<Result<void>> done(maps_.size());
    in_bands(view.height, threads, threads, [&](int band, int first_row, int rows) {
      done[static_cast<std::size_t>(band)] = render_band(view, maps_[static_cast<std::size_t>(band)], first_row, rows);
    });
    for (const auto& one : done)
      if (!one) return one;
    return {};
  }
  std::span<const std::byte> samples() const override { return frame_; }

 private:
  Result<void> render_band(const View& view, const GdalLevels& map, int first_row, int rows) {
    const int bands = map.bands(), texel = map.texel_bytes(), sample = texel / bands, line = texel * view.width;
    // The rows as a dataset
    GDALDriver* const memory = GetGDALDriverManager()->GetDriverByName("MEM");
    const std::unique_ptr<GDALDataset> frame(memory->Create("", view.width, rows, 0, map.type(), nullptr));
    std::byte* const first = frame_.data() + static_cast<std::ptrdiff_t>(first_row) * line;
    for (int b = 0; b < bands; ++b) {
      std::array<char, 64> pointer{};
      pointer[static_cast<std::size_t>(CPLPrintPointer(pointer.data(), first + b * sample, 63))] = 0;
      const std::string data = std::string("DATAPOINTER=") + pointer.data(),
                        pixel_offset = "PIXELOFFSET=" + std::to_string(texel),
                        line_offset = "LINEOFFSET=" + std::to_string(line);
      const char* const options[] = {data.c_str(), pixel_offset.c_str(), line_offset.c_str(), nullptr};
      frame->AddBand(map.type(), const_cast<char**>(options));
    }

    const MapPoint middle = map_point(view.map_pixel_from_image_pixel, view.width / 2.0, view.height / 2.0);
    int level = 0;
    while (level + 1 < map.count() && map.texels_x(level + 1) < footprint_texels(middle) * 1.01) ++level;
    Homography corner_from_centre, level_from_texel, frame_from_rows;
    corner_from_centre << 1, 0, 0.5, 0, 1, 0.5, 0, 0, 1;
    level_from_texel << 1 / map.texels_x(level), 0, 0, 0, 1 / map.texels_y(level), 0, 0, 0, 1;
    frame_from_rows << 1, 0, 0, 0, 1, first_row, 0, 0, 1;
    Transformer transformer;
    transformer.level_from_frame = level_from_texel * corner_from_centre *
                                   Eigen::Map<const Homography>(view.map_pixel_from_image_pixel.data()) *
                                   corner_from_centre.inverse() * frame_from_rows;
    transformer.frame_from_level = transformer.level_from_frame.inverse();
    struct Destroy {
      void operator()(void* t) const { GDALDestroyApproxTransformer(t); }
      void operator()(GDALWarpOptions* o) const { GDALDestroyWarpOptions(o); }
    };
    const std::unique_ptr<void, Destroy> approximate(GDALCreateApproxTransformer(transform, &transformer, 0.125));

    const std::unique_ptr<GDALWarpOptions, Destroy> options(GDALCreateWarpOptions());
    options->hSrcDS = &map.dataset(level);
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
    GDALWarpOperation operation;
    if (operation.Initialize(options.get()) != CE_None ||
        operation.ChunkAndWarpImage(0, 0, view.width, rows) != CE_None)
      return fail(Error::Kind::Io, std::string("GDAL cannot warp: ") + CPLGetLastErrorMsg());
    frame->FlushCache();
    return {};
  }

  std::vector<GdalLevels> maps_;
  GDALResampleAlg resampling_ = GRA_Bilinear;
  std::vector<std::byte> frame_;
};

}  // namespace
}  // namespace nadir::bench

int main(int argc, char** argv) { return nadir::bench::run_peer(argc, argv, nadir::bench::Warp::open); }
