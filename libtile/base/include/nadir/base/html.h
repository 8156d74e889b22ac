#pragma once

#include <string>
#include <string_view>

namespace nadir {

/// `text` as it may stand between tags and in quoted attributes of HTML and XML: markup escaped, and U+FFFD for what is
/// not UTF-8 or what XML forbids.
std::string escaped(std::string_view text);

std::string base64(std::string_view bytes);

}  // namespace nadir
