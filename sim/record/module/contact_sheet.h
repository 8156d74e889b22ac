#pragma once

#include "canvas.h"

namespace nadir::record {

struct DrawnSheet {
  Canvas picture;
  std::vector<Rectangle> thumbnails;  // as ContactSheet::frames
};

DrawnSheet draw(const ContactSheet& sheet);

}  // namespace nadir::record
