#include "nadir/tile/cell.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <mutex>
#include <vector>

namespace nadir::tile {
namespace {

/// First texel and number of texels of an apron part along one axis.
struct Extent {
  explicit Extent(int side)
      : first(side < 0   ? 0
              : side > 0 ? cell_size + cell_apron
                         : cell_apron),
        count(side == 0 ? cell_size : cell_apron) {}
  int first, count;
};

/// One of few mutexes for each cell: fills of one cell follow each other, those of different cells rarely wait.
std::mutex& mutex_of(const Cell& cell) {
  static std::array<std::mutex, 64> mutexes;
  return mutexes[(reinterpret_cast<std::uintptr_t>(&cell) / sizeof(Cell)) % mutexes.size()];
}

/// Samples of cells that are gone, for those to come: pages fresh from the system cost more than decoding into them.
/// Thread-safe.
class SpareSamples {
 public:
  std::unique_ptr<std::byte[]> take(std::size_t bytes) {
    {
      const std::scoped_lock lock(mutex_);
      if (auto& spare = spare_[bytes]; !spare.empty()) {
        auto samples = std::move(spare.back());
        spare.pop_back();
        held_bytes_ -= bytes;
        return samples;
      }
    }
    return std::unique_ptr<std::byte[]>(new std::byte[bytes]);  // not initialised
  }
  void give(std::unique_ptr<std::byte[]> samples, std::size_t bytes) {
    const std::scoped_lock lock(mutex_);
    if (held_bytes_ + bytes > most_bytes) return;
    held_bytes_ += bytes;
    spare_[bytes].push_back(std::move(samples));
  }

 private:
  static constexpr std::size_t most_bytes = 4 << 20;                        // four tiles of RGB
  std::mutex mutex_;                                                        // guards what follows
  std::map<std::size_t, std::vector<std::unique_ptr<std::byte[]>>> spare_;  // by size
  std::size_t held_bytes_ = 0;
};

SpareSamples& spare_samples() {
  static SpareSamples& spare = *new SpareSamples;  // outlives every cell
  return spare;
}

std::size_t sample_bytes(SampleType type, int bands) {
  return cell_area * static_cast<std::size_t>(bands) * size_bytes(type);
}

}  // namespace

Cell::Cell(SampleType type, int bands)
    : type_(type), bands_(bands), samples_(spare_samples().take(sample_bytes(type, bands))) {}

Cell::~Cell() { spare_samples().give(std::move(samples_), sample_bytes(type_, bands_)); }

std::uint8_t* Cell::writable_validity() {
  if (!validity_) {
    validity_.reset(new std::uint8_t[cell_area]);
    std::memset(validity_.get(), 1, cell_area);
    masked_.store(true, std::memory_order_release);
  }
  return validity_.get();
}

void Cell::make_invalid(std::string damage) {
  damage_ = std::move(damage);
  std::memset(samples(), 0, sample_bytes(type_, bands_));
  std::memset(writable_validity(), 0, cell_area);
}

void fill_apron(const Cell& cell, ApronPart part, const Cell& neighbour, ApronPart where) {
  const Extent x(part.dx), y(part.dy);
  const std::size_t texel = static_cast<std::size_t>(cell.bands_) * size_bytes(cell.type_);
  // The same texels in the neighbour's own count
  const int from_x = x.first - where.dx * cell_size, from_y = y.first - where.dy * cell_size;
  const std::scoped_lock lock(mutex_of(cell));
  if (cell.has(part)) return;
  bool invalid = false;
  for (int row = 0; row < y.count; ++row) {
    const std::size_t to = static_cast<std::size_t>(y.first + row) * cell_stride + static_cast<std::size_t>(x.first);
    const std::size_t from = static_cast<std::size_t>(from_y + row) * cell_stride + static_cast<std::size_t>(from_x);
    const auto count = static_cast<std::size_t>(x.count);
    std::memcpy(cell.samples_.get() + to * texel, neighbour.samples_.get() + from * texel, count * texel);
    invalid = invalid || (neighbour.masked() && std::memchr(neighbour.validity() + from, 0, count));
  }
  const bool first = invalid && !cell.validity_;
  if (first) {
    cell.validity_.reset(new std::uint8_t[cell_area]);
    std::memset(cell.validity_.get(), 1, cell_area);
  }
  for (int row = 0; row < y.count && cell.validity_; ++row) {
    std::uint8_t* to = cell.validity_.get() + (y.first + row) * cell_stride + x.first;
    if (invalid)
      std::memcpy(to, neighbour.validity() + (from_y + row) * cell_stride + from_x, static_cast<std::size_t>(x.count));
    else
      std::memset(to, 1, static_cast<std::size_t>(x.count));
  }
  if (first) cell.masked_.store(true, std::memory_order_release);
  cell.parts_.fetch_or(part.bit(), std::memory_order_release);
}

}  // namespace nadir::tile
