#pragma once

#include <cstdint>
#include <filesystem>

#include "nadir/base/result.h"

namespace nadir::bench {

/// Rows [first, first + count) of a made-up aerial photograph, `width` texels of RGB each: hills, fields with furrows,
/// roads, and noise of a sensor that is correlated over two texels, as that of demosaicked pictures is. A texel depends
/// on its place and `seed` alone, so that a smaller photograph is a part of a larger one. By additions and products of
/// floats only: the same bytes everywhere.
///
/// Its statistics are those of orthophotos of 0.2 to 1 m: DEFLATE with the horizontal predictor makes it about 2 times
/// smaller, JPEG of quality 90 with halved colour differences about 10 times (tests/bench/photo_test.cpp).
void photo_rows(std::uint64_t seed, std::int64_t first, std::int64_t count, std::int64_t width, std::uint8_t* out);

/// A square photograph in a file: its seed, and where it lies (1 m texels, UTM zone 33).
struct Photo {
  std::int64_t side = 0;
  std::uint64_t seed = 1;
};

/// The photograph as an uncompressed GeoTIFF in strips within `folder`, named after what it is: made on `threads`
/// threads where it is not there yet, whole or not at all. Io where the disk has no room for it.
Result<std::filesystem::path> photo_file(const Photo& photo, const std::filesystem::path& folder, int threads);

/// Error::Io, with advice, where less than `bytes` are free in `folder`.
Result<void> expect_free(const std::filesystem::path& folder, std::uint64_t bytes);

}  // namespace nadir::bench
