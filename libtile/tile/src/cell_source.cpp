#include "nadir/tile/cell_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>

namespace nadir::tile {
namespace {

std::uint64_t next_id() {
  static std::atomic<std::uint64_t> counter{1};
  return counter++;
}

/// Texels of a window, laid into a cell whose first texel (its apron's corner) is (first_x, first_y): what the window
/// does not cover lies beyond the level's edge and repeats the edge.
void lay_out(const void* from, const Window& window, int first_x, int first_y, std::size_t texel_bytes, void* to) {
  const int left = window.x - first_x, right = cell_stride - left - window.width;
  const auto* source = static_cast<const std::byte*>(from);
  auto* out = static_cast<std::byte*>(to);
  const std::size_t row_bytes = window.width * texel_bytes;
  for (int y = 0; y < cell_stride; ++y) {
    const int source_y = std::clamp(first_y + y, window.y, window.y + window.height - 1) - window.y;
    const std::byte* row = source + source_y * row_bytes;
    for (int x = 0; x < left; ++x, out += texel_bytes) std::memcpy(out, row, texel_bytes);
    std::memcpy(out, row, row_bytes);
    out += row_bytes;
    for (int x = 0; x < right; ++x, out += texel_bytes) std::memcpy(out, row + row_bytes - texel_bytes, texel_bytes);
  }
}

}  // namespace

CellSource::CellSource(const Map& map, std::vector<int> bands, SampleType type, Domain domain)
    : id_(next_id()), map_(map), bands_(std::move(bands)), type_(type), domain_(domain) {}

Result<std::shared_ptr<const CellSource>> CellSource::make(const Map& map, std::vector<int> bands, Domain domain) {
  if (bands.empty()) bands = map.description().data_bands();
  for (std::size_t i = 0; i < bands.size(); ++i)
    if (std::find(bands.begin(), bands.begin() + static_cast<std::ptrdiff_t>(i), bands[i]) !=
        bands.begin() + static_cast<std::ptrdiff_t>(i))
      return fail(Error::Kind::Malformed,
                  fmt::format("{}: band {} is asked for twice", map.description().path, bands[i]));
  const auto type = map.sample_type(bands);
  if (!type) return fail(type);
  const SampleType held = domain == Domain::Decibel ? SampleType::Float32 : *type;
  return std::shared_ptr<const CellSource>(new CellSource(map, std::move(bands), held, domain));
}

std::uint64_t CellSource::cell_bytes() const {
  constexpr std::uint64_t texels = static_cast<std::uint64_t>(cell_stride) * cell_stride;
  return texels * (bands_.size() * size_bytes(type_) + 1) + sizeof(Cell);
}

Result<CellPtr> CellSource::load(int level, std::int32_t col, std::int32_t row) const {
  const Level& size = map_.levels()[static_cast<std::size_t>(level)];
  const int first_x = col * cell_size - cell_apron, first_y = row * cell_size - cell_apron;
  Window window;
  window.x = std::max(first_x, 0);
  window.y = std::max(first_y, 0);
  window.width = std::min(first_x + cell_stride, size.width) - window.x;
  window.height = std::min(first_y + cell_stride, size.height) - window.y;
  auto texels = map_.read(level, window, bands_);
  if (!texels) return fail(texels);

  if (domain_ == Domain::Decibel) {
    const std::size_t count = static_cast<std::size_t>(window.width) * window.height * bands_.size();
    std::vector<std::byte> power(count * sizeof(float));
    auto* out = reinterpret_cast<float*>(power.data());
    with_sample_type(texels->type, [&]<class T>(T) {
      const T* decibels = reinterpret_cast<const T*>(texels->samples.data());
      // Samples of invalid texels may be NaN; zero power keeps arithmetic on them harmless.
      for (std::size_t i = 0; i < count; ++i) {
        const float value = static_cast<float>(decibels[i]);
        out[i] = std::isfinite(value) ? std::pow(10.0f, value / 10.0f) : 0.0f;
      }
    });
    texels->samples = std::move(power);
  }

  auto cell = std::make_shared<Cell>();
  cell->type = type_;
  cell->bands = static_cast<int>(bands_.size());
  constexpr std::size_t stride_area = static_cast<std::size_t>(cell_stride) * cell_stride;
  const std::size_t texel_bytes = bands_.size() * size_bytes(type_);
  cell->samples.resize(stride_area * texel_bytes);
  lay_out(texels->samples.data(), window, first_x, first_y, texel_bytes, cell->samples.data());
  if (!texels->validity.empty()) {
    cell->all_valid = false;
    cell->validity.resize(stride_area);
    lay_out(texels->validity.data(), window, first_x, first_y, 1, cell->validity.data());
  }
  return cell;
}

}  // namespace nadir::tile
