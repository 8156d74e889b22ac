#include "contact_sheet.h"

#include <algorithm>
#include <cmath>

#include "text.h"
#include "thumbnail.h"

namespace nadir::record {
namespace {

constexpr Colour ground{18, 21, 26}, edge{58, 65, 76}, bright{240, 243, 247}, dim{165, 174, 186};
constexpr int margin = 28, gap = 18, title_size = 24, title_height = 50, caption_size = 14, caption_height = 30;

struct Grid {
  int columns, rows;
  int cell_width, cell_height;  // of a thumbnail with its caption, without gaps
  int width() const { return 2 * margin + columns * cell_width + (columns - 1) * gap; }
  int height(bool titled) const {
    return 2 * margin + (titled ? title_height : 0) + rows * cell_height + (rows - 1) * gap;
  }
};

/// Thumbnail size of an image: as large as fits into a box of `width` by 3/4 of it.
Rectangle fitted(const ImageView& image, int width) {
  const double scale = std::min(static_cast<double>(width) / image.width, 0.75 * width / image.height);
  return {0, 0, std::max(1, static_cast<int>(std::lround(image.width * scale))),
          std::max(1, static_cast<int>(std::lround(image.height * scale)))};
}

/// The grid nearest to the shape of a screen, with few empty places.
Grid best_grid(int count, int cell_width, int cell_height, bool titled) {
  Grid best{};
  double least = HUGE_VAL;
  for (int columns = 1; columns <= count; ++columns) {
    const Grid grid{columns, (count + columns - 1) / columns, cell_width, cell_height};
    const double aspect = static_cast<double>(grid.width()) / grid.height(titled);
    const double empty = 1 - static_cast<double>(count) / (grid.columns * grid.rows);
    const double cost = std::abs(std::log(aspect / 1.6)) + empty;
    if (cost < least) best = grid, least = cost;
  }
  return best;
}

}  // namespace

DrawnSheet draw(const ContactSheet& sheet) {
  const int count = static_cast<int>(sheet.frames.size());
  const int cell_width = count <= 4 ? 480 : count <= 12 ? 360 : 288;  // few frames are shown larger
  int thumbnail_height = 1;
  for (const SheetFrame& frame : sheet.frames)
    thumbnail_height = std::max(thumbnail_height, fitted(frame.image, cell_width).height);
  const bool titled = !sheet.title.empty();
  const Grid grid = best_grid(std::max(1, count), cell_width, thumbnail_height + caption_height, titled);

  const Typeface typeface = Typeface::find();
  DrawnSheet drawn{Canvas(grid.width(), grid.height(titled), ground), {}};
  Canvas& picture = drawn.picture;
  if (titled) {
    const std::string title = typeface.fitted(sheet.title, title_size, grid.width() - 2 * margin);
    picture.paint(typeface.text(title, title_size, margin, margin + title_size), bright);
  }
  for (int i = 0; i < count; ++i) {
    const SheetFrame& frame = sheet.frames[static_cast<std::size_t>(i)];
    Rectangle area = fitted(frame.image, cell_width);
    const int left = margin + i % grid.columns * (cell_width + gap);
    const int top = margin + (titled ? title_height : 0) + i / grid.columns * (grid.cell_height + gap);
    area.x = left + (cell_width - area.width) / 2;
    area.y = top + (thumbnail_height - area.height) / 2;
    picture.fill({area.x - 1, area.y - 1, area.width + 2, area.height + 2}, edge);
    paint_thumbnail(picture, frame, area);
    const std::string caption = typeface.fitted(frame.caption, caption_size, cell_width);
    picture.paint(typeface.text(caption, caption_size, left + cell_width / 2, area.y + area.height + 21, Align::Centre),
                  dim);
    drawn.thumbnails.push_back(area);
  }
  return drawn;
}

}  // namespace nadir::record
