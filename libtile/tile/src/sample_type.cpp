#include "nadir/tile/sample_type.h"

#include <array>

#include "nadir/base/text.h"

namespace nadir::tile {
namespace {
constexpr std::array<std::string_view, 4> names = {"uint8", "int16", "uint16", "float32"};
}  // namespace

std::size_t size_bytes(SampleType type) {
  return with_sample_type(type, [](auto sample) { return sizeof sample; });
}

std::string_view to_string(SampleType type) { return names[static_cast<std::size_t>(type)]; }
Result<SampleType> parse_sample_type(std::string_view name) {
  return parse_name<SampleType>("sample type", name, names);
}

}  // namespace nadir::tile
