// libvips' mapim with its bilinear interpolator, on the level that fits the image's middle. Method: "bilinear".
#include <vips/vips.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "peer.h"

namespace nadir::bench {
namespace {

struct Unreference {
  void operator()(void* object) const { g_object_unref(object); }
};
using Image = std::unique_ptr<VipsImage, Unreference>;

tl::unexpected<Error> failed() {
  std::string message = vips_error_buffer();
  vips_error_clear();
  return fail(Error::Kind::Io, "libvips: " + message);
}

class MapIm : public Peer {
 public:
  static Result<std::unique_ptr<Peer>> open(const PeerSetup& setup) {
    if (setup.method != "bilinear") return fail(Error::Kind::NotFound, "no method '" + setup.method + "'");
    ::setenv("VIPS_WARNING", "0", 1);  // else it tells of each GeoTIFF tag of each level
    if (VIPS_INIT("nadir-peer-vips") != 0) return failed();
    vips_concurrency_set(setup.threads);
    vips_cache_set_max_mem(peer_cache_bytes);
    auto peer = std::make_unique<MapIm>();
    int pages = 1;
    for (int page = 0; page < pages; ++page) {  // levels follow one another as pages
      VipsImage* level = nullptr;
      if (vips_tiffload(setup.maps[0].c_str(), &level, "page", page, nullptr) != 0) return failed();
      peer->levels_.emplace_back(level);
      if (page == 0) pages = vips_image_get_n_pages(level);
    }
    peer->interpolate_.reset(vips_interpolate_new("bilinear"));
    return peer;
  }

  Result<void> render(const View& view) override {
    const auto& h = view.map_pixel_from_image_pixel;
    const MapPoint middle = map_point(h, view.width / 2.0, view.height / 2.0);
    const double side = std::sqrt(std::abs(middle.dx_du * middle.dy_dv - middle.dx_dv * middle.dy_du));
    const int last = static_cast<int>(levels_.size()) - 1;
    VipsImage* const level =
        levels_[static_cast<std::size_t>(std::clamp(static_cast<int>(std::lround(std::log2(side))), 0, last))].get();
    const double sx = 1.0 * level->Xsize / levels_[0]->Xsize, sy = 1.0 * level->Ysize / levels_[0]->Ysize;
    index_.resize(2 * static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height));
    float* out = index_.data();
    for (int y = 0; y < view.height; ++y)
      for (int x = 0; x < view.width; ++x) {
        const MapPoint at = map_point(h, x, y);
        *out++ = static_cast<float>((at.x + 0.5) * sx - 0.5);
        *out++ = static_cast<float>((at.y + 0.5) * sy - 0.5);
      }
    const Image index(vips_image_new_from_memory(index_.data(), index_.size() * sizeof(float), view.width, view.height,
                                                 2, VIPS_FORMAT_FLOAT));
    VipsImage* mapped = nullptr;
    if (!index || vips_mapim(level, &mapped, index.get(), "interpolate", interpolate_.get(), nullptr) != 0)
      return failed();
    const Image owner(mapped);
    std::size_t bytes = 0;
    samples_.reset(vips_image_write_to_memory(mapped, &bytes));
    bytes_ = bytes;
    if (!samples_) return failed();
    return {};
  }
  std::span<const std::byte> samples() const override {
    return {static_cast<const std::byte*>(samples_.get()), bytes_};
  }

 private:
  struct Free {
    void operator()(void* memory) const { g_free(memory); }
  };
  std::vector<Image> levels_;
  std::unique_ptr<VipsInterpolate, Unreference> interpolate_;
  std::vector<float> index_;
  std::unique_ptr<void, Free> samples_;
  std::size_t bytes_ = 0;
};

}  // namespace
}  // namespace nadir::bench

int main(int argc, char** argv) { return nadir::bench::run_peer(argc, argv, nadir::bench::MapIm::open); }
