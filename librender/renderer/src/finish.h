#pragma once

#include "nadir/render/frame.h"
#include "nadir/render/renderer.h"

namespace nadir::render {

/// From map values to what the sensor delivers: its output type, and what invalid pixels hold. Sets the valid fraction.
void finish_layer(const Layer& layer, const RenderOptions& options, FrameLayer& out);

}  // namespace nadir::render
