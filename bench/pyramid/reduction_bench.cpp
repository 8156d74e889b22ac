// What does a finer level cost to reduce, to compare with the coarser one, and to count, in its bytes a second on one
// core, beside copying it?
#include <benchmark/benchmark.h>

#include <cstring>
#include <random>

#include "reduction.h"

namespace nadir::pyramid {
namespace {

using tiff::Sample;

/// A tile of 512 texels and what an odd size needs beyond: 0.75 MB of RGB, in the second-level cache as in a build,
/// where it was just decoded.
constexpr std::int32_t side = 1024;

enum class Case { Plain, Odd, Whole, Holes };
constexpr const char* names[] = {"even", "odd", "all_valid", "holes"};

/// One texel of eight is missing where there are holes; none where all are valid.
Block random_block(const TexelType& type, LevelSize size, bool holes) {
  std::mt19937 random(1);
  Block block(type, {0, 0, size.width, size.height});
  tiff::with_sample(type.sample, [&]<class T>(T) {
    for (std::int32_t y = 0; y < size.height; ++y) {
      T* row = reinterpret_cast<T*>(block.row(y));
      for (std::int32_t x = 0; x < size.width; ++x) {
        const bool hole = holes && random() % 8 == 0;
        for (int b = 0; b < type.bands; ++b, ++row) {
          *row = static_cast<T>(1 + random() % 250);
          if (type.nodata && hole) *row = static_cast<T>(*type.nodata);
          if (type.alpha && b == type.bands - 1) *row = hole ? T{} : std::numeric_limits<T>::max();
        }
        if (type.mask) block.valid_row(y)[x] = hole ? 0 : 255;
      }
    }
  });
  return block;
}

struct Level {
  TexelType type;
  Case kind;
  LevelSize size = {side - (kind == Case::Odd ? 1 : 0), side - (kind == Case::Odd ? 1 : 0)};
  LevelSize coarse = {side / 2, side / 2};
  Block fine = random_block(type, size, kind == Case::Holes);
};

void count(benchmark::State& state, const Level& level) {
  state.SetBytesProcessed(state.iterations() *
                          static_cast<std::int64_t>(level.fine.texels() * level.type.texel_bytes()));
}

void BM_Copy(benchmark::State& state) {
  const Level level{{Sample::U8, 3}, Case::Plain};
  std::vector<std::byte> to(level.fine.texels() * 3);
  for (auto _ : state) {
    std::memcpy(to.data(), level.fine.row(0), to.size());
    benchmark::ClobberMemory();
  }
  count(state, level);
}
BENCHMARK(BM_Copy);

void BM_Reduce(benchmark::State& state, TexelType type, Case kind, Reduction reduction) {
  const Level level{type, kind};
  Block out(type, {0, 0, level.coarse.width, level.coarse.height});
  const Reducer reducer(type, reduction, level.size, level.coarse);
  for (auto _ : state) {
    reducer.reduce(level.fine, out);
    benchmark::ClobberMemory();
  }
  count(state, level);
}

void BM_Loss(benchmark::State& state, TexelType type, Case kind) {
  const Level level{type, kind};
  Block out(type, {0, 0, level.coarse.width, level.coarse.height});
  const Reducer reducer(type, {}, level.size, level.coarse);
  reducer.reduce(level.fine, out);
  std::vector<float> loss(static_cast<std::size_t>(type.data_bands()));
  for (auto _ : state) {
    reducer.loss(level.fine, level.fine.window(), out, loss);
    benchmark::ClobberMemory();
  }
  count(state, level);
}

void BM_Statistics(benchmark::State& state, TexelType type, Case kind) {
  const Level level{type, kind};
  for (auto _ : state) benchmark::DoNotOptimize(statistics(type, level.fine, level.fine.window()));
  count(state, level);
}

struct Type {
  const char* name;
  TexelType type;
};
const Type types[] = {{"u8x1", {Sample::U8, 1}},   {"u8x3", {Sample::U8, 3}},   {"u8x4", {Sample::U8, 4}},
                      {"u16x1", {Sample::U16, 1}}, {"u16x3", {Sample::U16, 3}}, {"u16x11", {Sample::U16, 11}},
                      {"i16x1", {Sample::I16, 1}}, {"f32x1", {Sample::F32, 1}}, {"f64x1", {Sample::F64, 1}}};
const Type types_with_holes[] = {{"u8x3_mask", {Sample::U8, 3, false, true}},
                                 {"u8x3_nodata", {Sample::U8, 3, false, false, 0.0}},
                                 {"u8x4_alpha", {Sample::U8, 4, true}},
                                 {"f32x1_nodata", {Sample::F32, 1, false, false, -9999.0}}};

void add(const Type& t, Case kind) {
  const std::string name = std::string(t.name) + "/" + names[static_cast<int>(kind)];
  benchmark::RegisterBenchmark(("BM_Reduce/box/" + name).c_str(), BM_Reduce, t.type, kind, Reduction{});
  benchmark::RegisterBenchmark(("BM_Loss/" + name).c_str(), BM_Loss, t.type, kind);
  benchmark::RegisterBenchmark(("BM_Statistics/" + name).c_str(), BM_Statistics, t.type, kind);
}

const bool registered = [] {
  for (const Type& t : types)
    for (const Case kind : {Case::Plain, Case::Odd}) add(t, kind);
  for (const Type& t : types_with_holes)
    for (const Case kind : {Case::Whole, Case::Holes}) add(t, kind);
  for (const Filter filter : {Filter::Gaussian, Filter::Lanczos, Filter::Nearest, Filter::Mode})
    for (const Case kind : {Case::Plain, Case::Odd})
      benchmark::RegisterBenchmark(
          ("BM_Reduce/" + std::string(to_string(filter)) + "/u8x1/" + names[static_cast<int>(kind)]).c_str(), BM_Reduce,
          TexelType{Sample::U8, 1}, kind, Reduction{filter});
  benchmark::RegisterBenchmark("BM_Reduce/power/f32x1/even", BM_Reduce, TexelType{Sample::F32, 1}, Case::Plain,
                               Reduction{Filter::Box, true});
  return true;
}();

}  // namespace
}  // namespace nadir::pyramid
