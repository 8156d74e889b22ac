#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "nadir/record/image.h"

namespace nadir::record {

/// Pixels of a picture; (x, y) is the first one.
struct Rectangle {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
  friend bool operator==(const Rectangle&, const Rectangle&) = default;
};

/// A place in a picture: x right, y down, the centre of the first pixel at (0.5, 0.5).
struct PicturePoint {
  double x = 0;
  double y = 0;
};

/// One thumbnail of a contact sheet.
///
/// Three or more channels are shown as red, green and blue, else the first one in grey. uint8 colours are
/// shown as they are; all else is stretched per channel, from its 2nd to its 98th percentile.
struct SheetFrame {
  ImageView image;
  std::string caption = {};
  std::span<const std::uint8_t> valid =
      {};                 // one a pixel, 0 where invalid; all valid where empty. NaN is always invalid
  bool decibels = false;  // averaged in power
};

/// Thumbnails with captions in a grid on a dark ground. It is for looking at: meant for up to about 30 frames,
/// chosen by the caller.
struct ContactSheet {
  std::string title;
  std::vector<SheetFrame> frames;
};

/// A map with the outlines of what was seen, first to last in the colours of a ramp, and the path of the camera.
///
/// Places are in pixels of the background and may lie outside it. A line to a point that is not finite, or
/// more than 1e9 px away, is left out: that corner sees no ground.
struct FootprintMap {
  SheetFrame background;                              // shown as a thumbnail of a sheet is; its caption is not
  std::vector<std::vector<PicturePoint>> footprints;  // outlines; the last point joins the first
  std::vector<PicturePoint> path;                     // camera positions, with a mark at the first and the last
  std::vector<PicturePoint> plan;                     // of the path, as far as one was made: dashed, below it
  double north_rad = 0;                               // where north is, clockwise from up
  double metres_per_pixel = 0;                        // of the background; no scale bar where it is not > 0
  std::string title;
  std::string attribution;  // of the background, as its licence asks
  std::string first_label;  // at the ends of the colour ramp: "0 s"
  std::string last_label;   //                             "60 s"
};

}  // namespace nadir::record
