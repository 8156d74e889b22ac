#include "image_rows.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <vector>

#include "image_codec.h"
#include "nadir/base/files.h"

namespace nadir::record {
namespace fs = std::filesystem;
namespace {

/// A file being written. What fails is remembered and not told to the encoder: OpenImageIO 2.4.7 takes a full disk for
/// a success, and libpng would jump over its destructors.
class RememberingFile final : public OIIO::Filesystem::IOProxy {
 public:
  explicit RememberingFile(const fs::path& path)
      : IOProxy(path.string(), Write), file_(std::fopen(path.c_str(), "w+b")), problem_(file_ ? 0 : errno) {}

  const char* proxytype() const override { return "nadir"; }
  std::size_t write(const void* bytes, std::size_t size) override {
    const std::size_t done = pwrite(bytes, size, m_pos);
    m_pos += static_cast<std::int64_t>(done);
    return done;
  }
  std::size_t pwrite(const void* bytes, std::size_t size, std::int64_t offset) override {
    move_to(offset);
    if (problem_ == 0 && std::fwrite(bytes, 1, size, file_.get()) != size) problem_ = errno;
    at_ = offset + static_cast<std::int64_t>(size);
    size_ = std::max(size_, at_);
    return size;
  }
  std::size_t read(void* bytes, std::size_t size) override {
    const std::size_t done = pread(bytes, size, m_pos);
    m_pos += static_cast<std::int64_t>(done);
    return done;
  }
  std::size_t pread(void* bytes, std::size_t size, std::int64_t offset) override {
    at_ = -1;  // between reading and writing the C library wants a seek
    move_to(offset);
    const std::size_t done = problem_ == 0 ? std::fread(bytes, 1, size, file_.get()) : 0;
    at_ = -1;
    return done;
  }
  std::size_t size() const override { return static_cast<std::size_t>(size_); }

  /// The first error number; 0 where all went well. `closing`: nothing will be written any more.
  int problem(bool closing) {
    if (closing && problem_ == 0 && std::fflush(file_.get()) != 0) problem_ = errno;
    return problem_;
  }

 private:
  void move_to(std::int64_t offset) {
    if (problem_ == 0 && at_ != offset && fseeko(file_.get(), offset, SEEK_SET) != 0) problem_ = errno;
  }
  struct CloseFile {
    void operator()(std::FILE* file) const noexcept { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, CloseFile> file_;
  int problem_;
  std::int64_t at_ = 0, size_ = 0;
};

class OpenImageIoRows final : public ImageRows {
 public:
  OpenImageIoRows(const fs::path& path, const ImageView& shape)
      : path_(path), temporary_(temporary_name(path)), file_(temporary_), shape_(shape) {}
  ~OpenImageIoRows() override {
    if (in_place_) return;
    // libpng complains on standard error of images that end before it has written any of their data
    constexpr std::size_t surely_some_bytes = 64 << 10;
    const std::vector<std::byte> blank(ImageView{nullptr, shape_.type, shape_.width, 1, shape_.channels}.size_bytes());
    while (output_ && row_ < shape_.height && file_.size() < surely_some_bytes &&
           output_->write_scanline(row_, 0, oiio_type(shape_.type), blank.data()))
      ++row_;
    output_.reset();
    std::error_code error;
    fs::remove(temporary_, error);
  }

  Result<void> open() {
    if (auto ok = check_written(false); !ok) return ok;
    auto output = open_output(path_, shape_, file_);
    if (!output) return fail(output);
    output_ = std::move(*output);
    return check_written(false);
  }

  Result<void> add(const void* samples, int rows) override {
    assert(rows > 0 && row_ + rows <= shape_.height);
    if (!output_->write_scanlines(row_, row_ + rows, 0, oiio_type(shape_.type), samples)) return encoding_failed();
    row_ += rows;
    return check_written(false);
  }

  Result<void> finish() override {
    assert(row_ == shape_.height);
    if (!output_->close()) return encoding_failed();
    output_.reset();
    if (auto ok = check_written(true); !ok) return ok;
    in_place_ = true;  // or removed, where it cannot be moved
    return move_into_place(temporary_, path_);
  }

 private:
  Result<void> encoding_failed() {
    if (auto ok = check_written(false); !ok) return ok;
    return fail(Error::Kind::Io, fmt::format("{}: encoding failed: {}", path_.string(), output_->geterror()));
  }
  Result<void> check_written(bool closing) {
    if (const int problem = file_.problem(closing); problem != 0)
      return fail(Error::Kind::Io, fmt::format("{}: writing failed: {}; nothing was left behind", path_.string(),
                                               std::strerror(problem)));
    return {};
  }

  const fs::path path_, temporary_;
  RememberingFile file_;
  const ImageView shape_;
  std::unique_ptr<OIIO::ImageOutput> output_;
  int row_ = 0;
  bool in_place_ = false;
};

}  // namespace

Result<std::unique_ptr<ImageRows>> begin_rows(const fs::path& path, const ImageView& shape) {
  std::error_code error;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
  auto rows = std::make_unique<OpenImageIoRows>(path, shape);
  if (auto ok = rows->open(); !ok) return fail(ok);
  return rows;
}

}  // namespace nadir::record
