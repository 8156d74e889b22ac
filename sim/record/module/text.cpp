#include "text.h"

#include <ft2build.h>
#include FT_FREETYPE_H

#include <algorithm>
#include <cstdlib>

#include "nadir/base/text.h"

namespace nadir::record {
namespace {

bool continues_character(char byte) { return (static_cast<unsigned char>(byte) & 0xC0) == 0x80; }

/// Code points of UTF-8; control characters become blanks, and what is not UTF-8 the replacement character.
std::u32string decoded(std::string_view text) {
  constexpr char32_t replacement = 0xFFFD;
  std::u32string points;
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i++]);
    const int more = lead < 0x80 ? 0 : lead >= 0xF0 ? 3 : lead >= 0xE0 ? 2 : lead >= 0xC0 ? 1 : -1;
    char32_t point = more < 0 ? replacement : more == 0 ? lead : lead & (0x3F >> more);
    for (int k = 0; k < more; ++k) {
      if (i == text.size() || !continues_character(text[i])) {
        point = replacement;
        break;
      }
      point = point << 6 | (static_cast<unsigned char>(text[i++]) & 0x3F);
    }
    points.push_back(point < 0x20 ? U' ' : point);
  }
  return points;
}

/// Calls `place(glyph, x_px)` for each character with its bitmap rendered; returns the width of the line.
template <class Place>
int set_line(FT_Face face, std::string_view text, int size_px, Place&& place) {
  if (FT_Set_Pixel_Sizes(face, 0, static_cast<FT_UInt>(size_px)) != 0) return 0;
  FT_Pos pen = 0;  // 1/64 px
  FT_UInt previous = 0;
  for (const char32_t point : decoded(text)) {
    const FT_UInt index = FT_Get_Char_Index(face, point);
    FT_Vector kerning{};
    if (previous != 0 && FT_Get_Kerning(face, previous, index, FT_KERNING_DEFAULT, &kerning) == 0) pen += kerning.x;
    if (FT_Load_Glyph(face, index, FT_LOAD_RENDER | FT_LOAD_TARGET_LIGHT) != 0) continue;
    place(*face->glyph, static_cast<int>((pen + 32) >> 6));
    pen += face->glyph->advance.x;
    previous = index;
  }
  return static_cast<int>((pen + 63) >> 6);
}

}  // namespace

void Typeface::Close::operator()(FT_Library library) const noexcept { FT_Done_FreeType(library); }
void Typeface::Close::operator()(FT_Face face) const noexcept { FT_Done_Face(face); }

Typeface Typeface::find() {
  Typeface typeface;
  FT_Library library = nullptr;
  if (FT_Init_FreeType(&library) != 0) return typeface;
  typeface.library_.reset(library);

  const auto take = [&](const char* file) {
    FT_Face face = nullptr;
    if (!typeface.face_ && FT_New_Face(library, file, 0, &face) == 0) typeface.face_.reset(face);
  };
  if (const char* named = std::getenv("NADIR_FONT")) {
    take(named);
    return typeface;
  }
  take("/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf");    // Debian
  take("/usr/share/fonts/dejavu-sans-fonts/DejaVuSans.ttf");  // Fedora
  take("/usr/share/fonts/TTF/DejaVuSans.ttf");                // Arch
  return typeface;
}

int Typeface::width_px(std::string_view text, int size_px) const {
  return face_ ? set_line(face_.get(), text, size_px, [](const FT_GlyphSlotRec&, int) {}) : 0;
}

Mask Typeface::text(std::string_view text, int size_px, int x, int y, Align align) const {
  const int width = width_px(text, size_px);
  if (width == 0) return {};
  const int shift = align == Align::Left ? 0 : align == Align::Centre ? width / 2 : width;
  // No glyph of a text font reaches farther than its size beyond its line
  const Rectangle box{x - shift - size_px, y - 2 * size_px, width + 2 * size_px, 3 * size_px};
  Mask mask(box);
  set_line(face_.get(), text, size_px, [&](const FT_GlyphSlotRec& glyph, int at) {
    const int left = x - shift + at + glyph.bitmap_left, top = y - glyph.bitmap_top;
    for (int row = 0; row < static_cast<int>(glyph.bitmap.rows); ++row) {
      if (top + row < box.y || top + row >= box.y + box.height) continue;
      float* out = mask.row(top + row);
      const unsigned char* in = glyph.bitmap.buffer + row * glyph.bitmap.pitch;
      for (int column = 0; column < static_cast<int>(glyph.bitmap.width); ++column) {
        const int place = left + column - box.x;
        if (place < 0 || place >= box.width) continue;
        out[place] = std::max(out[place], static_cast<float>(in[column]) / 255.0f);
      }
    }
  });
  return mask;
}

std::string Typeface::fitted(std::string_view text, int size_px, int limit_px) const {
  if (width_px(text, size_px) <= limit_px) return std::string(text);
  const auto shortened = [&](std::size_t bytes) {
    while (bytes > 0 && continues_character(text[bytes])) --bytes;
    return std::string(text.substr(0, bytes)) + "…";
  };
  // The longest start that fits lies between `fits` and `too_long` bytes
  std::size_t fits = 0, too_long = text.size();
  while (too_long - fits > 1) {
    const std::size_t middle = (fits + too_long) / 2;
    (width_px(shortened(middle), size_px) <= limit_px ? fits : too_long) = middle;
  }
  return fits == 0 ? std::string() : shortened(fits);
}

std::vector<std::string> Typeface::wrapped(std::string_view text, int size_px, int limit_px) const {
  std::vector<std::string> lines;
  for (const std::string_view word : split(text, ' ')) {
    const std::string longer = lines.empty() ? std::string() : lines.back() + " " + std::string(word);
    if (!lines.empty() && width_px(longer, size_px) <= limit_px) {
      lines.back() = longer;
    } else {
      lines.push_back(fitted(word, size_px, limit_px));
    }
  }
  return lines;
}

}  // namespace nadir::record
