// OpenCV's perspective warp. Methods: "original", the whole map in memory; "window_linear", "window_linear_2x2",
// "window_linear_4x4", "window_cubic", ...: for each of 8 bands of rows the window of the fitting level, read by GDAL,
// with so many samples a pixel, averaged.
#include <mutex>
#include <opencv2/imgproc.hpp>

#include "gdal_levels.h"

namespace nadir::bench {
namespace {

int mat_type(const GdalLevels& map) {
  return CV_MAKETYPE(map.type() == GDT_Byte ? CV_8U : map.type() == GDT_UInt16 ? CV_16U : CV_32F, map.bands());
}

std::span<const std::byte> bytes_of(const cv::Mat& image) {
  return {reinterpret_cast<const std::byte*>(image.data), image.total() * image.elemSize()};
}

class WholeMap : public Peer {
 public:
  static Result<std::unique_ptr<Peer>> open(const PeerSetup& setup) {
    const auto map = GdalLevels::open(setup.maps[0]);
    if (!map) return fail(map);
    if (std::max(map->width(0), map->height(0)) >= 32768)
      return fail(Error::Kind::Unsupported, "OpenCV warps no image of 32768 pixels a side or more");
    auto peer = std::make_unique<WholeMap>();
    peer->map_.create(map->height(0), map->width(0), mat_type(*map));
    // By rows of tiles: one read of all would fill GDAL's cache beside it
    for (int y = 0; y < map->height(0); y += 512)
      if (const auto read = map->read(0, 0, y, map->width(0), std::min(512, map->height(0) - y), peer->map_.ptr(y));
          !read)
        return fail(read);
    cv::setNumThreads(setup.threads);
    return peer;
  }

  Result<void> render(const View& view) override {
    const cv::Mat h(3, 3, CV_64F, const_cast<double*>(view.map_pixel_from_image_pixel.data()));
    cv::warpPerspective(map_, frame_, h, {view.width, view.height}, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP);
    return {};
  }
  std::span<const std::byte> samples() const override { return bytes_of(frame_); }

 private:
  cv::Mat map_, frame_;
};

class Windows : public Peer {
 public:
  Windows(int interpolation, int samples_a_side, int threads)
      : interpolation_(interpolation), samples_a_side_(samples_a_side), threads_(threads) {}

  static Result<std::unique_ptr<Peer>> open(const PeerSetup& setup, int interpolation, int samples_a_side) {
    auto peer = std::make_unique<Windows>(interpolation, samples_a_side, setup.threads);
    for (int i = 0; i < setup.threads; ++i) {  // a dataset serves one thread at a time
      auto map = GdalLevels::open(setup.maps[0]);
      if (!map) return fail(map);
      peer->maps_.push_back(std::move(*map));
    }
    peer->parts_.resize(bands);
    cv::setNumThreads(1);  // within a band; bands run side by side
    return peer;
  }

  Result<void> render(const View& view) override {
    frame_.create(view.height, view.width, mat_type(maps_[0]));
    Result<void> all;
    std::mutex mutex;  // guards `all`
    in_bands(view.height, bands, threads_, [&](int band, int first_row, int rows) {
      const auto done = render_band(view, band, first_row, rows);
      const std::scoped_lock lock(mutex);
      if (!done && all) all = done;
    });
    return all;
  }
  std::span<const std::byte> samples() const override { return bytes_of(frame_); }

 private:
  static constexpr int bands = 8;

  Result<void> render_band(const View& view, int band, int first_row, int rows) {
    const GdalLevels& map = maps_[static_cast<std::size_t>(band % threads_)];
    Part& part = parts_[static_cast<std::size_t>(band)];
    const auto& h = view.map_pixel_from_image_pixel;
    const MapPoint middle = map_point(h, view.width / 2.0, first_row + rows / 2.0);
    const int level = map.nearest(footprint_texels(middle) / samples_a_side_);
    const double sx = map.texels_x(level), sy = map.texels_y(level);

    // The window of the level that the band sees, and what the interpolation needs beside it
    double left = 1e300, top = 1e300, right = -1e300, bottom = -1e300;
    for (const double u : {-0.5, view.width - 0.5})
      for (const double v : {first_row - 0.5, first_row + rows - 0.5}) {
        const MapPoint corner = map_point(h, u, v);
        left = std::min(left, (corner.x + 0.5) / sx), right = std::max(right, (corner.x + 0.5) / sx);
        top = std::min(top, (corner.y + 0.5) / sy), bottom = std::max(bottom, (corner.y + 0.5) / sy);
      }
    constexpr int margin = 3;
    const int x0 = std::clamp(static_cast<int>(left) - margin, 0, map.width(level) - 1),
              x1 = std::clamp(static_cast<int>(right) + margin + 1, x0 + 1, map.width(level)),
              y0 = std::clamp(static_cast<int>(top) - margin, 0, map.height(level) - 1),
              y1 = std::clamp(static_cast<int>(bottom) + margin + 1, y0 + 1, map.height(level));
    part.window.create(y1 - y0, x1 - x0, mat_type(map));
    if (const auto read = map.read(level, x0, y0, x1 - x0, y1 - y0, part.window.data); !read) return read;

    // Samples of the band's pixels to texels of the window, both with centres at whole numbers
    const int n = samples_a_side_;
    const cv::Matx33d texel_from_pixel(h.data());
    const cv::Matx33d pixel_from_sample(1.0 / n, 0, 0.5 / n - 0.5, 0, 1.0 / n, 0.5 / n - 0.5 + first_row, 0, 0, 1);
    const cv::Matx33d window_from_texel(1 / sx, 0, 0.5 / sx - 0.5 - x0, 0, 1 / sy, 0.5 / sy - 0.5 - y0, 0, 0, 1);
    const cv::Mat window_from_sample(window_from_texel * texel_from_pixel * pixel_from_sample);
    cv::Mat out = frame_.rowRange(first_row, first_row + rows);
    const auto warp = [&](cv::Mat& to) {
      cv::warpPerspective(part.window, to, window_from_sample, {view.width * n, rows * n},
                          interpolation_ | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
    };
    if (n == 1) {
      warp(out);
    } else {
      warp(part.samples);
      cv::resize(part.samples, out, out.size(), 0, 0, cv::INTER_AREA);
    }
    return {};
  }

  struct Part {
    cv::Mat window, samples;
  };
  int interpolation_, samples_a_side_, threads_;
  std::vector<GdalLevels> maps_;
  std::vector<Part> parts_;
  cv::Mat frame_;
};

Result<std::unique_ptr<Peer>> open(const PeerSetup& setup) {
  const std::string& method = setup.method;
  if (method == "original") return WholeMap::open(setup);
  for (const auto& [name, interpolation] :
       {std::pair{"window_linear", cv::INTER_LINEAR}, {"window_cubic", cv::INTER_CUBIC}})
    for (const auto& [suffix, side] : {std::pair{"", 1}, {"_2x2", 2}, {"_4x4", 4}})
      if (method == std::string(name) + suffix) return Windows::open(setup, interpolation, side);
  return fail(Error::Kind::NotFound, "no method '" + method + "'");
}

}  // namespace
}  // namespace nadir::bench

int main(int argc, char** argv) { return nadir::bench::run_peer(argc, argv, nadir::bench::open); }
