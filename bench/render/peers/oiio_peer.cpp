// OpenImageIO's texture system, a lookup a pixel with its derivatives. Methods: "trilinear", "aniso".
#include <OpenImageIO/texture.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "peer.h"

namespace nadir::bench {
namespace {

using namespace OIIO;

class Lookups : public Peer {
 public:
  static Result<std::unique_ptr<Peer>> open(const PeerSetup& setup) {
    auto peer = std::make_unique<Lookups>();
    peer->threads_ = setup.threads;
    peer->system_.reset(TextureSystem::create(false));
    TextureSystem& system = *peer->system_;
    system.attribute("max_memory_MB", static_cast<float>(peer_cache_bytes >> 20));
    system.attribute("automip", 0);
    OIIO::attribute("limits:imagesize_MB", 1 << 20);  // the usual limit refuses the widest map
    peer->name_ = ustring(setup.maps[0]);
    peer->handle_ = system.get_texture_handle(peer->name_);
    const ImageSpec* spec = system.imagespec(peer->name_);
    if (!spec || !system.good(peer->handle_)) return fail(Error::Kind::NotFound, system.geterror());
    peer->map_width_ = spec->width;
    peer->map_height_ = spec->height;
    peer->bands_ = spec->nchannels;
    peer->type_ = spec->format;
    const bool aniso = setup.method == "aniso";
    if (!aniso && setup.method != "trilinear") return fail(Error::Kind::NotFound, "no method '" + setup.method + "'");
    peer->options_.mipmode = aniso ? TextureOpt::MipModeAniso : TextureOpt::MipModeTrilinear;
    peer->options_.interpmode = TextureOpt::InterpBilinear;
    peer->options_.anisotropic = 16;
    peer->options_.swrap = peer->options_.twrap = TextureOpt::WrapClamp;
    return peer;
  }

  Result<void> render(const View& view) override {
    frame_.resize(static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height) *
                  static_cast<std::size_t>(bands_) * type_.size());
    bool all = true;
    in_bands(view.height, threads_, threads_, [&](int, int first_row, int rows) {
      TextureSystem::Perthread* const own = system_->get_perthread_info();
      for (int y = first_row; y < first_row + rows; ++y)
        if (!render_row(view, y, own)) all = false;
    });
    if (!all) return fail(Error::Kind::Io, "OpenImageIO: " + system_->geterror());
    return {};
  }
  std::span<const std::byte> samples() const override { return frame_; }

 private:
  bool render_row(const View& view, int y, TextureSystem::Perthread* own) {
    TextureOpt options = options_;
    std::byte* out =
        frame_.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width * bands_) * type_.size();
    const auto sx = 1.0 / map_width_, sy = 1.0 / map_height_;
    std::array<float, 8> value{};
    for (int x = 0; x < view.width; ++x) {
      const MapPoint at = map_point(view.map_pixel_from_image_pixel, x, y);
      const auto f = [](double v) { return static_cast<float>(v); };
      if (!system_->texture(handle_, own, options, f((at.x + 0.5) * sx), f((at.y + 0.5) * sy), f(at.dx_du * sx),
                            f(at.dy_du * sy), f(at.dx_dv * sx), f(at.dy_dv * sy), bands_, value.data()))
        return false;
      for (int b = 0; b < bands_; ++b, out += type_.size()) store(value[static_cast<std::size_t>(b)], out);
    }
    return true;
  }

  void store(float value, std::byte* out) const {
    const auto whole = [&](auto type, float most) {
      type = static_cast<decltype(type)>(std::clamp(value, 0.0f, 1.0f) * most + 0.5f);
      std::memcpy(out, &type, sizeof type);
    };
    if (type_ == TypeUInt8)
      whole(std::uint8_t{}, 255);
    else if (type_ == TypeUInt16)
      whole(std::uint16_t{}, 65535);
    else
      std::memcpy(out, &value, sizeof value);
  }

  struct Destroy {
    void operator()(TextureSystem* system) const { TextureSystem::destroy(system); }
  };
  std::unique_ptr<TextureSystem, Destroy> system_;
  TextureSystem::TextureHandle* handle_ = nullptr;
  ustring name_;
  TextureOpt options_;
  TypeDesc type_;
  int map_width_ = 0, map_height_ = 0, bands_ = 0, threads_ = 1;
  std::vector<std::byte> frame_;
};

}  // namespace
}  // namespace nadir::bench

int main(int argc, char** argv) { return nadir::bench::run_peer(argc, argv, nadir::bench::Lookups::open); }
