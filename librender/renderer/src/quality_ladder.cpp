#include "nadir/render/quality_ladder.h"

#include <fmt/format.h>

#include <array>

namespace nadir::render {

std::span<const Rung> quality_ladder() {
  static constexpr std::array<Rung, 8> ladder = {{{Quality::draft, {}},
                                                  {Quality::balanced, 1.1},
                                                  {Quality::balanced, 1.6},
                                                  {Quality::balanced, 2.1},
                                                  {Quality::balanced, 3.1},
                                                  {Quality::balanced, 4.1},
                                                  {Quality::balanced, 6.1},
                                                  {Quality::balanced, 8.1}}};
  return ladder;
}

RenderOptions with_rung(RenderOptions options, const Rung& rung) {
  options.quality = rung.quality;
  options.filter.reset();
  options.oversampling = rung.oversampling;
  options.max_error.reset();
  return options;
}

std::string to_string(const Rung& rung) {
  std::string text(to_string(rung.quality));
  if (rung.oversampling) text += fmt::format(", oversampling {}", *rung.oversampling);
  return text;
}

}  // namespace nadir::render
