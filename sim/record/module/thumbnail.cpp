#include "thumbnail.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace nadir::record {
namespace {

/// One axis of area averaging: output i is made of inputs first[i] ... with these weights.
struct Reduction {
  struct Part {
    int input;
    double weight;  // the share of the input that lies in the output's interval
  };
  std::vector<std::vector<Part>> outputs;

  Reduction(int inputs, int count) : outputs(static_cast<std::size_t>(count)) {
    const double step = static_cast<double>(inputs) / count;
    for (int i = 0; i < count; ++i) {
      const double from = i * step, to = std::min<double>((i + 1) * step, inputs);
      for (int input = static_cast<int>(from); input < to; ++input)
        outputs[static_cast<std::size_t>(i)].push_back(
            {input, std::min(to, input + 1.0) - std::max(from, static_cast<double>(input))});
    }
  }
};

/// A reduced channel: the mean over valid pixels, and the share of them.
struct Plane {
  std::vector<double> mean;
  std::vector<double> share;
};

template <class T>
Plane reduce(const SheetFrame& frame, int channel, int width, int height) {
  const ImageView& image = frame.image;
  const auto* samples = static_cast<const T*>(image.samples);
  const auto columns = static_cast<std::size_t>(image.width), channels = static_cast<std::size_t>(image.channels);
  const Reduction across(image.width, width), down(image.height, height);
  const double all = (static_cast<double>(image.width) / width) * (static_cast<double>(image.height) / height);

  Plane plane;
  for (const auto& rows : down.outputs) {
    for (const auto& parts : across.outputs) {
      double sum = 0, weights = 0;
      for (const auto [row, row_weight] : rows) {
        for (const auto [column, weight] : parts) {
          const std::size_t pixel = static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column);
          if (!frame.valid.empty() && frame.valid[pixel] == 0) continue;
          const auto value = static_cast<double>(samples[pixel * channels + static_cast<std::size_t>(channel)]);
          if (!std::isfinite(value)) continue;
          sum += row_weight * weight * (frame.decibels ? std::pow(10.0, value / 10) : value);
          weights += row_weight * weight;
        }
      }
      const double mean = weights > 0 ? sum / weights : 0;
      plane.mean.push_back(frame.decibels ? 10 * std::log10(std::max(mean, 1e-30)) : mean);
      plane.share.push_back(weights / all);
    }
  }
  return plane;
}

/// Values shown as black and as white: the 2nd and 98th percentile of the thumbnail, since nobody sees
/// a range that averaging took away (a radar's speckle).
std::pair<double, double> shown_range(const Plane& plane) {
  std::vector<double> values;
  for (std::size_t i = 0; i < plane.mean.size(); ++i) {
    if (plane.share[i] > 0) values.push_back(plane.mean[i]);
  }
  if (values.empty()) return {0, 1};
  const auto percentile = [&](double fraction) {
    const auto at = values.begin() + std::lround(fraction * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
  };
  const double low = percentile(0.02), high = percentile(0.98);
  if (high > low) return {low, high};
  return {low - 1, low + 1};  // one value only: a middle grey
}

}  // namespace

void paint_thumbnail(Canvas& canvas, const SheetFrame& frame, Rectangle area) {
  assert(frame.valid.empty() || frame.valid.size() == frame.image.pixel_count());
  const bool colour = frame.image.channels >= 3;
  const bool as_it_is = colour && frame.image.type == tile::SampleType::UInt8;

  // Reduce, and find what is black and white
  std::array<Plane, 3> planes;
  std::array<std::pair<double, double>, 3> ranges;
  for (std::size_t c = 0; c < (colour ? 3 : 1); ++c) {
    planes[c] = tile::with_sample_type(frame.image.type, [&](auto sample) {
      return reduce<decltype(sample)>(frame, static_cast<int>(c), area.width, area.height);
    });
    ranges[c] = as_it_is ? std::pair{0.0, 255.0} : shown_range(planes[c]);
  }

  // Paint, with a hatch where most pixels are invalid
  const auto grey = [&](std::size_t channel, std::size_t pixel) {
    const std::size_t c = colour ? channel : 0;
    const auto [low, high] = ranges[c];
    return static_cast<std::uint8_t>(
        std::lround(255 * std::clamp((planes[c].mean[pixel] - low) / (high - low), 0.0, 1.0)));
  };
  std::size_t pixel = 0;
  for (int y = 0; y < area.height; ++y) {
    for (int x = 0; x < area.width; ++x, ++pixel) {
      const bool stripe = (x + y) / 4 % 2 == 0;
      const Colour hatch = stripe ? Colour{40, 45, 53} : Colour{30, 34, 41};
      const bool shown = planes[0].share[pixel] >= 0.5;
      canvas.blend(area.x + x, area.y + y, shown ? Colour{grey(0, pixel), grey(1, pixel), grey(2, pixel)} : hatch, 1);
    }
  }
}

}  // namespace nadir::record
