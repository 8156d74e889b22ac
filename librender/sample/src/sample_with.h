#pragma once

#include "kernels.h"
#include "nadir/render/sample_block.h"

namespace nadir::render {

/// `sample_block` by given kernels.
void sample_block_with(const Kernels& kernels, const BlockSampling& block, const tile::CellSource& source, void* out,
                       std::uint8_t* validity, std::size_t stride_px);

}  // namespace nadir::render
