#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/record/image.h"
#include "nadir/record/pictures.h"

namespace nadir::record {

/// An image file that is written from the top while its rows are made. Destroyed before `finish`, it leaves nothing
/// behind. One thread at a time.
class ImageRows {
 public:
  virtual ~ImageRows() = default;
  /// The next rows, laid out as in ImageView. Those of TIFF files are packed in strips: numbers of rows that are
  /// multiples of 64, but for the last ones, give the bytes of the whole image written at once.
  virtual Result<void> add(const void* samples, int rows) = 0;
  /// After the last row: puts the file in place.
  virtual Result<void> finish() = 0;
};

/// Reads and writes image files, and draws pictures for people.
///
/// A file is encoded in memory, written under a temporary name and renamed: afterwards it holds
/// the whole image, or what it held before. The same pixels give the same bytes. Missing folders are made.
/// Thread-safe.
class ImageFiles {
 public:
  virtual ~ImageFiles() = default;

  /// The extension chooses the format. `.png` holds uint8 and uint16 with 1 to 4 channels; `.tif` and
  /// `.tiff` (deflate, lossless) all types with any number of channels up to 65535. Anything else is
  /// Error::Unsupported. Channels are data: a second or fourth one is never multiplied into the others as alpha.
  virtual Result<void> write(const std::filesystem::path& path, const ImageView& image) const = 0;

  /// As `write`, row by row, in little memory. `shape`: the whole image, without samples.
  virtual Result<std::unique_ptr<ImageRows>> begin(const std::filesystem::path& path, const ImageView& shape) const = 0;

  /// The first image of a PNG or TIFF file. Types other than ours are read as float32.
  virtual Result<Image> read(const std::filesystem::path& path) const = 0;

  /// Draws and writes `sheet`. Returns where each thumbnail lies in the picture, for pages that link to frames.
  virtual Result<std::vector<Rectangle>> write_contact_sheet(const std::filesystem::path& path,
                                                             const ContactSheet& sheet) const = 0;

  /// Draws and writes `map`. Returns where its background lies in the picture.
  virtual Result<Rectangle> write_footprint_map(const std::filesystem::path& path, const FootprintMap& map) const = 0;
};

/// The image files of the module `nadir_images.so`, which holds OpenImageIO and is loaded at the first
/// call (0.25 s and 90 MiB that programs without images do not pay) from one of `module_folders()`.
/// It stays loaded; after a failure the next call tries again.
/// Error: NotFound without the module, Unsupported where it belongs to another version or does not load.
/// Thread-safe.
Result<const ImageFiles*> image_files();

/// As `image_files()`, from the first of `folders` that has the module.
Result<const ImageFiles*> load_image_files(std::span<const std::filesystem::path> folders);

}  // namespace nadir::record
