#pragma once

#include <optional>
#include <span>
#include <string>

#include "nadir/render/renderer.h"

namespace nadir::render {

/// A way of sampling, as RenderOptions ask for it.
struct Rung {
  Quality quality = Quality::balanced;
  std::optional<double> oversampling;  // else the quality's
};

/// From the cheapest to the finest: what `max_error` and time budgets choose from. Without cubic samples, which are
/// nearer to the ground than to the reference.
std::span<const Rung> quality_ladder();

/// The options with this way of sampling in place of their own and of `max_error`.
RenderOptions with_rung(RenderOptions options, const Rung& rung);

/// "draft", "balanced, oversampling 2.1".
std::string to_string(const Rung& rung);

}  // namespace nadir::render
