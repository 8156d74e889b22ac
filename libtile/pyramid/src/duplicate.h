#pragma once

#include <cstddef>

namespace nadir::pyramid {

/// Each of `texels` texels of `texel_bytes` bytes twice, one behind the other: a row of a level in the texels of the
/// finer one, where that is twice as long.
void duplicate_texels(const std::byte* row, std::byte* out, std::size_t texels, std::size_t texel_bytes);

namespace scalar {
void duplicate_texels(const std::byte* row, std::byte* out, std::size_t texels, std::size_t texel_bytes);
}

}  // namespace nadir::pyramid
