#include "nadir/tile/sample_type.h"

#include <array>

namespace nadir::tile {

std::size_t size_bytes(SampleType type) {
  return with_sample_type(type, [](auto sample) { return sizeof sample; });
}

std::string_view to_string(SampleType type) {
  static constexpr std::array<std::string_view, 4> names = {"uint8", "int16", "uint16", "float32"};
  return names[static_cast<std::size_t>(type)];
}

}  // namespace nadir::tile
