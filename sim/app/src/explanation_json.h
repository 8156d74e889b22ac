#pragma once

#include <nlohmann/json.hpp>

#include "nadir/render/explanation.h"

namespace nadir::app {

/// How a frame was made: `layers`, `frame`, `exposure` (null for an instant shutter) and `times` as data, and in
/// `done` and `left_out` the lines that people are told.
nlohmann::ordered_json to_json(const render::Explanation& explanation);

/// Milliseconds of each stage and their shares of the whole.
nlohmann::ordered_json to_json(const render::StageTimes& times);

}  // namespace nadir::app
