#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "mask.h"

struct FT_LibraryRec_;
struct FT_FaceRec_;

namespace nadir::record {

enum class Align { Left, Centre, Right };

/// DejaVu Sans (Debian package fonts-dejavu-core), or the font file that the environment variable NADIR_FONT
/// names. Where there is none, every text is an empty mask and pictures are made without words.
/// One thread at a time.
///
/// Through FreeType, which OpenImageIO draws with too: its own `render_text` garbles all but ASCII before 2.4.14,
/// the sign in "© OpenStreetMap" included.
class Typeface {
 public:
  static Typeface find();

  /// `text` (UTF-8) on one line whose baseline starts, is centred or ends at (x, y).
  Mask text(std::string_view text, int size_px, int x, int y, Align align = Align::Left) const;

  int width_px(std::string_view text, int size_px) const;

  /// `text`, or as much of its start as fits into `limit_px`, with an ellipsis.
  std::string fitted(std::string_view text, int size_px, int limit_px) const;

  /// `text` in lines of at most `limit_px`, broken at blanks; nothing of it is lost but the end of too long a word.
  std::vector<std::string> wrapped(std::string_view text, int size_px, int limit_px) const;

 private:
  struct Close {
    void operator()(FT_LibraryRec_* library) const noexcept;
    void operator()(FT_FaceRec_* face) const noexcept;
  };
  std::unique_ptr<FT_LibraryRec_, Close> library_;
  std::unique_ptr<FT_FaceRec_, Close> face_;  // none: no font
};

}  // namespace nadir::record
