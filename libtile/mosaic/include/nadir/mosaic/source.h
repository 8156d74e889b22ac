#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/mosaic/block.h"
#include "nadir/mosaic/grid.h"
#include "nadir/tile/map_description.h"

namespace nadir::mosaic {

/// Which of two sources lies on top where both hold data.
enum class Overlap : std::uint8_t { Last, First, Newest, Oldest, Finest };
std::string_view to_string(Overlap overlap);  // "last"
Result<Overlap> parse_overlap(std::string_view name);

struct SourceOptions {
  /// Rasters of any kind that GDAL reads; folders of rasters; folders of XYZ tiles DIR/{zoom}/{x}/{y}.png; text files
  /// (.txt) that list sources, one a line, relative to themselves.
  std::vector<std::string> names;
  std::vector<std::string> bands;  // names, or numbers from 1; empty: all. Alpha always stays.
  std::optional<int> zoom;         // of XYZ folders; else the deepest there
  Overlap overlap = Overlap::Last;
  bool alpha_to_mask = false;            // opacity from half on becomes validity: for codecs that store colours only
  bool nodata_to_mask = false;           // for codecs that change samples
  bool expand_palettes = false;          // to colours
  std::uint64_t cache_bytes = 64 << 20;  // for blocks that were decoded and may be asked for again
};

/// What each band of the map is.
struct BandProperties {
  std::string name, color, unit;  // as tile::Band has them
  double scale = 1, offset = 0;
  std::vector<std::pair<std::string, std::string>> metadata;  // statistics left out
  std::vector<std::string> categories;
};

/// One raster, opened. Reading is counted: blocks that it is stored in, and how often one was decoded.
/// Thread-safe.
class Source {
 public:
  virtual ~Source() = default;

  const std::string& label() const { return description_.path; }  // as the user called it
  const tile::MapDescription& description() const { return description_; }
  virtual std::int64_t width() const = 0;
  virtual std::int64_t height() const = 0;

  /// Texels of a block as it is stored: what is read at once.
  virtual Window block() const = 0;
  /// Whether any window may be read at the cost of its own bytes: nothing to decode.
  virtual bool plain() const = 0;

  /// Fills `to`, whose window lies within the raster, with samples of the map's type. Validity becomes what the map
  /// has: mask, nodata or alpha, whichever this raster has.
  virtual Result<void> read(Block& to) const = 0;

  virtual std::int64_t blocks() const = 0;          // in all
  virtual std::int64_t blocks_decoded() const = 0;  // so far; none where plain()

 protected:
  tile::MapDescription description_;
};

/// All that goes into a map, bottom first, made equal.
struct Sources {
  std::vector<std::shared_ptr<const Source>> rasters;
  std::vector<std::vector<std::shared_ptr<const Source>>> overviews;  // of each raster, finest first; may be none
  TexelType type;
  std::vector<BandProperties> bands;   // alpha last
  std::vector<std::uint16_t> palette;  // 3 * 2^bits of red, all, then green, then blue, 0 to 65535; empty: none
  std::vector<std::pair<std::string, std::string>> metadata;  // on which all agree, not that of the files themselves
  bool pixel_is_point = false;
  std::vector<std::string> warnings;
};

/// Opens what `options` name, lists what is in folders in the order of their names, and makes bands and types agree:
/// bands by the names or colours of the first where all have them, else by position; grey becomes red, green and blue
/// beside colours; the sample type is the smallest that holds all; complex becomes magnitude; what is nodata in one
/// becomes nodata of all, or mask, or alpha.
/// Errors name the source that cannot go with the first, and what to do.
Result<Sources> open_sources(const SourceOptions& options);

}  // namespace nadir::mosaic
