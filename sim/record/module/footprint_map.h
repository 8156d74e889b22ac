#pragma once

#include "canvas.h"

namespace nadir::record {

struct DrawnMap {
  Canvas picture;
  Rectangle background;  // where it lies in the picture
};

/// `map.background` is uint8 with 3 channels.
DrawnMap draw(const FootprintMap& map);

}  // namespace nadir::record
