#pragma once

#include <string_view>

namespace nadir::record {

extern const std::string_view report_style;   // CSS
extern const std::string_view report_script;  // JavaScript

}  // namespace nadir::record
