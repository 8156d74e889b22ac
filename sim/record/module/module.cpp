#include <OpenImageIO/imageio.h>

#include "../src/image_module.h"
#include "contact_sheet.h"
#include "footprint_map.h"
#include "image_codec.h"
#include "image_rows.h"
#include "nadir/base/files.h"

namespace nadir::record {
namespace fs = std::filesystem;
namespace {

class OpenImageIoFiles final : public ImageFiles {
 public:
  // Frames are written by threads of the caller's choosing; a pool of OpenImageIO's would compete with them.
  OpenImageIoFiles() { OIIO::attribute("threads", 1); }

  Result<void> write(const fs::path& path, const ImageView& image) const override {
    const auto bytes = encode(path, image);
    if (!bytes) return fail(bytes);
    return write_file(path, {reinterpret_cast<const char*>(bytes->data()), bytes->size()});
  }

  Result<std::unique_ptr<ImageRows>> begin(const fs::path& path, const ImageView& shape) const override {
    return begin_rows(path, shape);
  }

  Result<Image> read(const fs::path& path) const override { return decode(path); }

  Result<std::vector<Rectangle>> write_contact_sheet(const fs::path& path, const ContactSheet& sheet) const override {
    const DrawnSheet drawn = draw(sheet);
    if (const auto written = write(path, drawn.picture.view()); !written) return fail(written);
    return drawn.thumbnails;
  }

  Result<Rectangle> write_footprint_map(const fs::path& path, const FootprintMap& map) const override {
    const DrawnMap drawn = draw(map);
    if (const auto written = write(path, drawn.picture.view()); !written) return fail(written);
    return drawn.background;
  }
};

}  // namespace
}  // namespace nadir::record

extern "C" [[gnu::visibility("default")]] const nadir::record::ImageFiles* nadir_image_files_2() {
  static const nadir::record::OpenImageIoFiles files;
  return &files;
}
