#pragma once

#include "nadir/render/renderer.h"

namespace nadir::render {

Result<void> check(const RenderOptions& options);

/// The original's rule: a frame is whole, or there is none.
Result<void> refuse_off_map(const Layer& layer, const Truth& truth);

}  // namespace nadir::render
