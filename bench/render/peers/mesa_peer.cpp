// Mesa's llvmpipe, a rasteriser of OpenGL on the CPU. Methods: "trilinear", "aniso" (16 times). The map's part that a
// view sees is a texture with levels, made when the view is first rendered; a plane is drawn with it.
#include <GL/osmesa.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "gdal_levels.h"

#ifndef GL_TEXTURE_MAX_ANISOTROPY_EXT
#define GL_TEXTURE_MAX_ANISOTROPY_EXT 0x84FE
#endif

namespace nadir::bench {
namespace {

constexpr int largest_texture = 8192;

class Rasterised : public Peer {
 public:
  explicit Rasterised(GdalLevels map) : map_(std::move(map)) {}
  static Result<std::unique_ptr<Peer>> open(const PeerSetup& setup) {
    if (setup.method != "trilinear" && setup.method != "aniso")
      return fail(Error::Kind::NotFound, "no method '" + setup.method + "'");
    auto map = GdalLevels::open(setup.maps[0]);
    if (!map) return fail(map);
    if (map->type() != GDT_Byte || map->bands() != 3)
      return fail(Error::Kind::Unsupported, "llvmpipe is asked for three bands of bytes only");
    // llvmpipe counts the threads beside the one that asks
    ::setenv("LP_NUM_THREADS", std::to_string(setup.threads == 1 ? 0 : setup.threads).c_str(), 1);
    ::setenv("GALLIUM_DRIVER", "llvmpipe", 1);
    auto peer = std::make_unique<Rasterised>(std::move(*map));
    peer->aniso_ = setup.method == "aniso";
    peer->context_.reset(OSMesaCreateContextExt(OSMESA_RGBA, 0, 0, 0, nullptr));
    if (!peer->context_) return fail(Error::Kind::Unsupported, "OSMesa makes no context");
    return peer;
  }

  Result<void> render(const View& view) override {
    if (!(view == view_))
      if (const auto ready = prepare(view); !ready) return ready;
    glClear(GL_COLOR_BUFFER_BIT);
    // The image's corners, w as deep as the homography has it: texture coordinates are then exact in perspective
    glBegin(GL_TRIANGLE_STRIP);
    const auto& h = view.map_pixel_from_image_pixel;
    for (const auto& [x, y] : {std::pair{-1.0, 1.0}, {1.0, 1.0}, {-1.0, -1.0}, {1.0, -1.0}}) {
      const double u = (x + 1) / 2 * view.width - 0.5, v = (y + 1) / 2 * view.height - 0.5;
      const double w = h[6] * u + h[7] * v + h[8];
      const MapPoint at = map_point(h, u, v);
      glTexCoord2d(((at.x + 0.5) / texels_x_ - left_) / texture_width_,
                   ((at.y + 0.5) / texels_y_ - top_) / texture_height_);
      glVertex4d(x / w, y / w, 0, 1 / w);
    }
    glEnd();
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadPixels(0, 0, view.width, view.height, GL_RGB, GL_UNSIGNED_BYTE, frame_.data());
    if (glGetError() != GL_NO_ERROR) return fail(Error::Kind::Io, "OpenGL fails");
    return {};
  }
  std::span<const std::byte> samples() const override { return frame_; }

 private:
  Result<void> prepare(const View& view) {
    const auto pixels = static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height);
    buffer_.resize(pixels * 4);
    frame_.resize(pixels * 3);
    if (!OSMesaMakeCurrent(context_.get(), buffer_.data(), GL_UNSIGNED_BYTE, view.width, view.height))
      return fail(Error::Kind::Unsupported, "OSMesa cannot draw into a frame of this size");
    OSMesaPixelStore(OSMESA_Y_UP, 0);  // rows from the top

    // The finest level whose window fits a texture
    double left = 1e300, top = 1e300, right = -1e300, bottom = -1e300;
    for (const double u : {-0.5, view.width - 0.5})
      for (const double v : {-0.5, view.height - 0.5}) {
        const MapPoint corner = map_point(view.map_pixel_from_image_pixel, u, v);
        left = std::min(left, corner.x), right = std::max(right, corner.x);
        top = std::min(top, corner.y), bottom = std::max(bottom, corner.y);
      }
    constexpr int margin = 32;  // for coarser levels
    int level = 0;
    while (level + 1 < map_.count() &&
           std::max((right - left) / map_.texels_x(level), (bottom - top) / map_.texels_y(level)) + 2 * margin + 2 >
               largest_texture)
      ++level;
    texels_x_ = map_.texels_x(level), texels_y_ = map_.texels_y(level);
    const auto first = [&](double at, double texels) { return std::max(static_cast<int>(at / texels) - margin, 0); };
    left_ = first(left, texels_x_), top_ = first(top, texels_y_);
    texture_width_ = std::min(static_cast<int>(right / texels_x_) + margin + 1, map_.width(level)) - left_;
    texture_height_ = std::min(static_cast<int>(bottom / texels_y_) + margin + 1, map_.height(level)) - top_;
    std::vector<std::byte> texels(static_cast<std::size_t>(texture_width_) * static_cast<std::size_t>(texture_height_) *
                                  3);
    if (const auto read = map_.read(level, left_, top_, texture_width_, texture_height_, texels.data()); !read)
      return read;

    glViewport(0, 0, view.width, view.height);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    if (texture_ == 0) glGenTextures(1, &texture_);
    glBindTexture(GL_TEXTURE_2D, texture_);
    glTexParameteri(GL_TEXTURE_2D, GL_GENERATE_MIPMAP, GL_TRUE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    if (aniso_) glTexParameterf(GL_TEXTURE_2D, GL_TEXTURE_MAX_ANISOTROPY_EXT, 16);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, texture_width_, texture_height_, 0, GL_RGB, GL_UNSIGNED_BYTE,
                 texels.data());
    glTexEnvi(GL_TEXTURE_ENV, GL_TEXTURE_ENV_MODE, GL_REPLACE);
    glEnable(GL_TEXTURE_2D);
    glDisable(GL_DITHER);
    view_ = view;
    return {};
  }

  struct Destroy {
    void operator()(OSMesaContext context) const { OSMesaDestroyContext(context); }
  };
  GdalLevels map_;
  bool aniso_ = false;
  std::unique_ptr<osmesa_context, Destroy> context_;
  View view_;
  GLuint texture_ = 0;
  double texels_x_ = 1, texels_y_ = 1;
  int left_ = 0, top_ = 0, texture_width_ = 1, texture_height_ = 1;
  std::vector<std::byte> buffer_, frame_;
};

}  // namespace
}  // namespace nadir::bench

int main(int argc, char** argv) { return nadir::bench::run_peer(argc, argv, nadir::bench::Rasterised::open); }
