#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "nadir/base/byte_source.h"
#include "nadir/tiff/directory.h"

namespace nadir::tiff {

/// A tile of a directory: `plane` is the band where bands are stored apart, else 0.
struct TileAddress {
  std::uint32_t directory = 0;  // index in TiffFile::directories()
  std::uint32_t plane = 0, col = 0, row = 0;
};

/// Where a tile's packed bytes lie. Size 0: the tile was never written and holds nothing.
struct TilePlace {
  std::uint64_t offset = 0, size = 0;
};

class Pages;

/// The directories of a TIFF, classic or big, in either byte order, read from its headers alone. Strips are tiles as
/// wide as the image.
///
/// The tables of where tiles lie are read when a tile is asked for, a page at a time, and few pages are kept: opening
/// costs the same for a map of any size. Offsets are trusted only as far as the file reaches.
/// Thread-safe.
class TiffFile {
 public:
  /// Malformed where it is no TIFF or breaks the format; Unsupported where some directory has no tiles or is packed in
  /// a way that is not read here.
  static Result<std::shared_ptr<const TiffFile>> open(std::shared_ptr<const ByteSource> source);
  ~TiffFile();
  TiffFile(const TiffFile&) = delete;
  TiffFile& operator=(const TiffFile&) = delete;

  const ByteSource& source() const;
  const std::vector<Directory>& directories() const { return directories_; }
  bool cloud_optimized() const { return cloud_optimized_; }  // GDAL's note that headers come before data

  /// Values of a field. Malformed where they lie beyond the file or are not of that kind.
  Result<std::string> text(const Field& field) const;
  Result<std::vector<double>> numbers(const Field& field) const;

  /// Bytes of a table, through the pages that are kept of headers and tables.
  Result<void> read_table(std::uint64_t offset, std::span<std::byte> out) const;

  /// Where tiles lie, in their order. What the tables need to be read for all of them is read at once.
  /// Damaged, with the cause alone for its message, for a tile that does not lie within the file or is larger than any
  /// packing makes it.
  std::vector<Result<TilePlace>> locate(std::span<const TileAddress> tiles) const;

 private:
  TiffFile(std::shared_ptr<const ByteSource> source);
  Result<void> read_directories();
  Result<Directory> read_directory(std::uint64_t place, std::uint64_t& next) const;
  Result<std::uint64_t> unsigned_value(const Field* field, std::uint64_t absent) const;
  Result<std::uint64_t> unsigned_at(std::uint64_t place, std::uint32_t size) const;  // of 1, 2, 4 or 8 bytes
  template <class T>
  T to_native(const std::byte* bytes) const;

  std::unique_ptr<Pages> pages_;
  std::vector<Directory> directories_;
  bool big_ = false, big_endian_ = false, cloud_optimized_ = false;
};

}  // namespace nadir::tiff
