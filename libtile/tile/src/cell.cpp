#include "nadir/tile/cell.h"

#include <cstring>
#include <map>
#include <mutex>
#include <vector>

namespace nadir::tile {
namespace {

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
  }
  return validity_.get();
}

void Cell::make_invalid(std::string damage) {
  damage_ = std::move(damage);
  std::memset(samples(), 0, sample_bytes(type_, bands_));
  std::memset(writable_validity(), 0, cell_area);
}

}  // namespace nadir::tile
