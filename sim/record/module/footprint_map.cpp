#include "footprint_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "text.h"
#include "thumbnail.h"

namespace nadir::record {
namespace {

constexpr Colour ground{18, 21, 26}, bright{240, 243, 247}, dim{165, 174, 186}, dark{8, 10, 13}, white{255, 255, 255};
constexpr Colour start_green{61, 220, 132}, end_red{255, 82, 82}, plan_yellow{255, 224, 102};
constexpr int margin = 20, title_height = 56, title_size = 22, least_title_size = 14, label_size = 14,
              footer_margin = 18, footer_size = 12, footer_line = 16;
constexpr double line_width = 2, halo_width = 6, halo_opacity = 0.5;

/// Colour of the ramp at 0 (first) to 1 (last): all bright, since fields, water and roofs are dark or dull.
Colour ramp(double t) {
  constexpr std::array<Colour, 5> stops = {
      {{45, 212, 255}, {132, 148, 255}, {236, 100, 240}, {255, 112, 88}, {255, 214, 56}}};
  const double place = std::clamp(t, 0.0, 1.0) * (stops.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(place), stops.size() - 2);
  return mix(stops[i], stops[i + 1], place - static_cast<double>(i));
}

double ramp_place(std::size_t index, std::size_t count) {
  return count > 1 ? static_cast<double>(index) / static_cast<double>(count - 1) : 0.0;
}

/// What is drawn over the background: lines and text with a dark halo, inside the background only.
struct Overlay {
  Canvas& picture;
  Rectangle area;  // of the background
  const Typeface& typeface;

  std::vector<PicturePoint> placed(std::span<const PicturePoint> points) const {
    std::vector<PicturePoint> out;
    for (const PicturePoint p : points) out.push_back({p.x + area.x, p.y + area.y});
    return out;
  }
  void stroke(std::span<const PicturePoint> points, bool closed, Colour colour, double width = line_width) const {
    picture.paint(line(points, closed, width + halo_width - line_width, area), dark, halo_opacity);
    picture.paint(line(points, closed, width, area), colour);
  }
  void label(std::string_view text, int x, int y, Align align) const {
    const Mask letters = typeface.text(text, label_size, x, y, align);
    picture.paint(grown(letters, 2), dark, 0.6);
    picture.paint(letters, white);
  }
};

/// Tints what any footprint covers with the mean of their colours, so that a hundred overlapping
/// footprints hide the ground no more than one.
void tint_swath(const Overlay& overlay, const FootprintMap& map) {
  struct Sum {
    float r = 0, g = 0, b = 0, weight = 0;
  };
  const Rectangle area = overlay.area;
  std::vector<Sum> sums(static_cast<std::size_t>(area.width) * static_cast<std::size_t>(area.height));
  for (std::size_t i = 0; i < map.footprints.size(); ++i) {
    const Colour colour = ramp(ramp_place(i, map.footprints.size()));
    const Mask mask = record::area(overlay.placed(map.footprints[i]), area);
    for (int y = mask.box.y; y < mask.box.y + mask.box.height; ++y) {
      const float* row = mask.row(y);
      Sum* sum =
          &sums[static_cast<std::size_t>(y - area.y) * static_cast<std::size_t>(area.width)] + (mask.box.x - area.x);
      for (int x = 0; x < mask.box.width; ++x, ++sum) {
        sum->r += row[x] * colour.r, sum->g += row[x] * colour.g, sum->b += row[x] * colour.b;
        sum->weight += row[x];
      }
    }
  }
  constexpr double opacity = 0.16;
  std::size_t pixel = 0;
  for (int y = area.y; y < area.y + area.height; ++y) {
    for (int x = area.x; x < area.x + area.width; ++x, ++pixel) {
      const Sum& sum = sums[pixel];
      if (sum.weight <= 0) continue;
      const auto mean = [&](float channel) {
        return static_cast<std::uint8_t>(std::min(255.0f, channel / sum.weight));
      };
      overlay.picture.blend(x, y, {mean(sum.r), mean(sum.g), mean(sum.b)}, opacity * std::min(1.0f, sum.weight));
    }
  }
}

/// Dashes of one length along a plan, whatever its points.
void draw_dashes(const Overlay& overlay, std::span<const PicturePoint> plan) {
  constexpr double dash = 9, gap = 6;
  std::vector<PicturePoint> stroke;
  double along = 0;  // of dash and gap
  const auto end_stroke = [&] {
    if (stroke.size() > 1) overlay.stroke(stroke, false, plan_yellow);
    stroke.clear();
  };
  for (std::size_t i = 0; i + 1 < plan.size(); ++i) {
    const PicturePoint a = plan[i], b = plan[i + 1];
    const double length = std::hypot(b.x - a.x, b.y - a.y);
    for (double done = 0; done < length;) {
      const auto at = [&](double pixels) {
        return PicturePoint{a.x + (b.x - a.x) * pixels / length, a.y + (b.y - a.y) * pixels / length};
      };
      const double step = std::min((along < dash ? dash : dash + gap) - along, length - done);
      if (along < dash) {
        if (stroke.empty()) stroke.push_back(at(done));
        stroke.push_back(at(done + step));
      }
      done += step;
      along += step;
      if (along >= dash - 1e-9 && along < dash + 1e-9) end_stroke(), along = dash;
      if (along >= dash + gap - 1e-9) along = 0;
    }
  }
  end_stroke();
}

/// The plan, and what its dashes are in the upper left corner.
void draw_plan(const Overlay& overlay, const FootprintMap& map) {
  if (map.plan.size() < 2) return;
  draw_dashes(overlay, overlay.placed(map.plan));
  const double left = overlay.area.x + margin, y = overlay.area.y + margin;
  const std::array key = {PicturePoint{left, y}, PicturePoint{left + 39, y}};
  draw_dashes(overlay, key);
  overlay.label("planned", static_cast<int>(left) + 48, static_cast<int>(y) + label_size * 3 / 8, Align::Left);
}

void draw_path(const Overlay& overlay, const FootprintMap& map) {
  if (map.path.empty()) return;
  const std::vector<PicturePoint> path = overlay.placed(map.path);
  overlay.stroke(path, false, white);
  const auto mark = [&](PicturePoint p, Colour colour) {
    overlay.stroke({&p, 1}, false, white, 14);
    overlay.picture.paint(line({&p, 1}, false, 10, overlay.area), colour);
  };
  mark(path.back(), end_red);
  mark(path.front(), start_green);  // on top, where a loop ends at its start
}

/// An arrow in the upper right corner, light on its left and dark on its right side, under its letter.
void draw_north(const Overlay& overlay, double north_rad) {
  if (!std::isfinite(north_rad)) return;
  const double cx = overlay.area.x + overlay.area.width - margin - 24, cy = overlay.area.y + margin + 32;
  const auto at = [&](double right, double forward) {
    return PicturePoint{cx + forward * std::sin(north_rad) + right * std::cos(north_rad),
                        cy - forward * std::cos(north_rad) + right * std::sin(north_rad)};
  };
  const std::array outline = {at(0, 18), at(11, -16), at(0, -9), at(-11, -16)};
  overlay.picture.paint(line(outline, true, 5, overlay.area), dark, halo_opacity);
  overlay.picture.paint(area(outline, overlay.area), white);
  const std::array right_half = {outline[0], outline[1], outline[2]};
  overlay.picture.paint(area(right_half, overlay.area), {96, 106, 120});
  const PicturePoint letter = at(0, 29);
  overlay.label("N", static_cast<int>(std::lround(letter.x)),
                static_cast<int>(std::lround(letter.y)) + label_size * 3 / 8, Align::Centre);
}

/// The longest of 1, 2 and 5 times a power of ten that is at most `limit`.
double round_length(double limit) {
  const double power = std::pow(10.0, std::floor(std::log10(limit)));
  for (const double digit : {5.0, 2.0}) {
    if (digit * power <= limit) return digit * power;
  }
  return power;
}

std::string length_text(double metres) {
  if (metres >= 1000) return fmt::format("{:g} km", metres / 1000);
  if (metres >= 1) return fmt::format("{:g} m", metres);
  return fmt::format("{:g} mm", metres * 1000);
}

/// A bar of at most a quarter of the width, in four parts, in the lower left corner.
void draw_scale(const Overlay& overlay, double metres_per_pixel) {
  if (!(metres_per_pixel > 0) || !std::isfinite(metres_per_pixel)) return;
  const double metres = round_length(0.25 * overlay.area.width * metres_per_pixel);
  const double length = metres / metres_per_pixel, left = overlay.area.x + margin;
  const double bottom = overlay.area.y + overlay.area.height - margin, top = bottom - 7;
  const auto box = [&](double from, double to, double grow) {
    const std::array corners = {PicturePoint{from - grow, top - grow}, PicturePoint{to + grow, top - grow},
                                PicturePoint{to + grow, bottom + grow}, PicturePoint{from - grow, bottom + grow}};
    return area(corners, overlay.area);
  };
  overlay.picture.paint(box(left, left + length, 2), dark, 0.75);
  for (int part = 0; part < 4; ++part)
    overlay.picture.paint(box(left + part * length / 4, left + (part + 1) * length / 4, 0),
                          part % 2 == 0 ? white : Colour{74, 82, 94});
  overlay.label(length_text(metres), static_cast<int>(left + length / 2), static_cast<int>(top) - 9, Align::Centre);
}

/// The colour ramp with its labels, at the right of the title. Returns the width taken.
int draw_legend(Canvas& picture, const Typeface& typeface, const FootprintMap& map) {
  constexpr int length = 140, thickness = 8, space = 10;
  if (map.footprints.size() < 2 || picture.box().width < 480) return 0;
  const int right = picture.box().width - margin, baseline = title_height / 2 + label_size * 3 / 8;
  const int last = typeface.width_px(map.last_label, label_size),
            first = typeface.width_px(map.first_label, label_size);
  const int bar = right - (last ? last + space : 0) - length;
  for (int x = 0; x < length; ++x)
    picture.fill({bar + x, (title_height - thickness) / 2, 1, thickness}, ramp(x / (length - 1.0)));
  picture.paint(typeface.text(map.last_label, label_size, right, baseline, Align::Right), dim);
  picture.paint(typeface.text(map.first_label, label_size, bar - space, baseline, Align::Right), dim);
  return right - bar + (first ? first + space : 0) + 2 * space;
}

}  // namespace

DrawnMap draw(const FootprintMap& map) {
  const ImageView& background = map.background.image;
  const Rectangle area{0, title_height, background.width, background.height};
  const Typeface typeface = Typeface::find();
  const std::vector<std::string> attribution =
      typeface.wrapped(map.attribution, footer_size, background.width - 2 * margin);
  const int footer_height = footer_margin + static_cast<int>(attribution.size()) * footer_line;
  DrawnMap drawn{Canvas(background.width, title_height + background.height + footer_height, ground), area};
  Canvas& picture = drawn.picture;
  paint_thumbnail(picture, map.background, area);

  // From the ground up: swath, outlines, path, furniture
  const Overlay overlay{picture, area, typeface};
  tint_swath(overlay, map);
  for (std::size_t i = 0; i < map.footprints.size(); ++i)
    overlay.stroke(overlay.placed(map.footprints[i]), true, ramp(ramp_place(i, map.footprints.size())));
  draw_plan(overlay, map);
  draw_path(overlay, map);
  draw_north(overlay, map.north_rad);
  draw_scale(overlay, map.metres_per_pixel);

  const int taken = draw_legend(picture, typeface, map);
  const int room = picture.box().width - 2 * margin - taken;
  int size = title_size;
  while (size > least_title_size && typeface.width_px(map.title, size) > room) --size;
  picture.paint(typeface.text(typeface.fitted(map.title, size, room), size, margin, title_height / 2 + size * 3 / 8),
                bright);
  int baseline = area.y + area.height + footer_margin / 2 + footer_size;
  for (const std::string& words : attribution) {  // all of it: licences ask for the whole
    picture.paint(typeface.text(words, footer_size, margin, baseline), dim);
    baseline += footer_line;
  }
  return drawn;
}

}  // namespace nadir::record
