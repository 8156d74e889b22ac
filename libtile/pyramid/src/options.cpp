#include <array>

#include "nadir/base/text.h"
#include "nadir/pyramid/build.h"

namespace nadir::pyramid {
namespace {
constexpr std::array<std::string_view, 7> compressions = {"none", "deflate", "zstd", "lzw", "jpeg", "webp", "lerc"};
}  // namespace

std::string_view to_string(Compression compression) { return compressions[static_cast<std::size_t>(compression)]; }
Result<Compression> parse_compression(std::string_view name) {
  return parse_name<Compression>("compression", name, compressions);
}

}  // namespace nadir::pyramid
