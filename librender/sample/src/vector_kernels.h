#pragma once

#include <vector>

#include "kernels.h"

namespace nadir::render {

/// Of each instruction set that this machine and this build have, the fastest last.
std::vector<const Kernels*> vector_kernels();

}  // namespace nadir::render
