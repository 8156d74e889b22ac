#pragma once

#include "kernels.h"
#include "nadir/render/sample_block.h"

namespace nadir::render {

/// What samples are, in cells and in the frame.
struct SampleFormat {
  tile::SampleType type = tile::SampleType::UInt8;
  int bands = 1;
  tile::Domain domain = tile::Domain::Linear;
};

/// `sample_block` by given kernels, of cells wherever they come from.
void sample_block_with(const Kernels& kernels, const BlockSampling& block, const SampleFormat& format,
                       std::span<const BlockTarget> targets, std::size_t stride_px);

}  // namespace nadir::render
