#include <array>

#include "nadir/base/text.h"
#include "nadir/pyramid/build.h"

namespace nadir::pyramid {
namespace {
constexpr std::array<std::string_view, 8> compressions = {"none", "deflate", "zstd", "lzw",
                                                          "lzma", "jpeg",    "webp", "lerc"};
constexpr std::array<std::string_view, 5> filters = {"box", "gaussian", "lanczos", "nearest", "mode"};
}  // namespace

std::string_view to_string(Compression compression) { return compressions[static_cast<std::size_t>(compression)]; }
Result<Compression> parse_compression(std::string_view name) {
  return parse_name<Compression>("compression", name, compressions);
}

std::string_view to_string(Filter filter) { return filters[static_cast<std::size_t>(filter)]; }
Result<Filter> parse_filter(std::string_view name) { return parse_name<Filter>("filter", name, filters); }

}  // namespace nadir::pyramid
