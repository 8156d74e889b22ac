#pragma once

#include "canvas.h"

namespace nadir::record {

/// Paints `frame`, reduced by averaging the valid pixels under each of its own, into `area` of `canvas`.
/// Invalid parts are hatched.
void paint_thumbnail(Canvas& canvas, const SheetFrame& frame, Rectangle area);

}  // namespace nadir::record
