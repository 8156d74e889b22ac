#pragma once

#include <filesystem>
#include <memory>

#include "disk_file.h"
#include "nadir/mosaic/source.h"

namespace nadir::pyramid {

/// A raster whose stored blocks are too wide to be kept for all chunks that share them: unpacked to disk once, from
/// the top, and read from there.
class SpooledSource : public mosaic::Source {
 public:
  /// Unpacks `source` to `file`, unless that was done before. `bytes`: to be held at a time, about.
  static Result<std::shared_ptr<const Source>> make(std::shared_ptr<const Source> source, const mosaic::TexelType& type,
                                                    const std::filesystem::path& file, std::uint64_t bytes,
                                                    bool show_progress);

  std::int64_t width() const override { return source_->width(); }
  std::int64_t height() const override { return source_->height(); }
  mosaic::Window block() const override { return source_->block(); }
  bool plain() const override { return true; }
  Result<void> read(mosaic::Block& to) const override;
  std::int64_t blocks() const override { return source_->blocks(); }
  std::int64_t blocks_decoded() const override { return source_->blocks_decoded(); }

 private:
  SpooledSource(std::shared_ptr<const Source> source, const mosaic::TexelType& type);
  std::uint64_t row_bytes() const;  // of samples, then of validity
  Result<void> unpack(const DiskFile& file, std::uint64_t bytes, bool show_progress) const;

  std::shared_ptr<const Source> source_;
  mosaic::TexelType type_;
  DiskFile file_;  // rows, each of samples and, where there is a mask, validity
};

}  // namespace nadir::pyramid
