#pragma once

#include <cstdint>

namespace nadir::bench {

/// Times that this thread has called operator new.
std::int64_t allocations();

}  // namespace nadir::bench
