#include "nadir/render/sample_block.h"

#include "part_sampler.h"
#include "sample_with.h"

namespace nadir::render {
namespace {

template <class T>
SamplerScratch<T>& scratch() {
  static thread_local SamplerScratch<T> of_thread;
  return of_thread;
}

}  // namespace

void sample_block_with(const Kernels& kernels, const BlockSampling& block, const SampleFormat& format,
                       std::span<const BlockTarget> targets, std::size_t stride_px) {
  const bool decibel = format.domain == tile::Domain::Decibel;
  const Part whole{0, 0, block.width, block.height};
  tile::with_sample_type(format.type, [&]<class T>(T) {
    const auto sample = [&]<class Value>(Value) {
      PartSampler<T, Value>(kernels, block, format.bands, decibel, targets, stride_px, scratch<T>()).sample(whole);
    };
    // Cubic samples leave the range of their type, and have no place in 16 bits
    block.interpolation == Interpolation::Cubic ? sample(float{}) : sample(Bilinear<T>{});
  });
}

void sample_block(const BlockSampling& block, const tile::CellSource& source, std::span<const BlockTarget> targets,
                  std::size_t stride_px) {
  sample_block_with(best_kernels(), block, {source.type(), static_cast<int>(source.bands().size()), source.domain()},
                    targets, stride_px);
}

}  // namespace nadir::render
