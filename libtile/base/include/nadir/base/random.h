#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace nadir {

/// Philox 4x32-10: sixteen random bytes for each counter, under a key.
/// Source: Salmon, Moraes, Dror and Shaw, Parallel random numbers: as easy as 1, 2, 3, 2011.
std::array<std::uint32_t, 4> philox_4x32_10(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key);

/// Random numbers with an address: a draw depends on the seed, the stream's name, the sample and the channel, and on no
/// draw before it. A value; safe to share.
class RandomStream {
 public:
  RandomStream(std::uint64_t seed, std::string_view name);

  std::array<std::uint32_t, 4> bits(std::uint64_t sample, std::uint64_t channel) const;

  /// Independent draws of the standard normal distribution, none beyond 6.7. Those of one kind of CPU: sines and
  /// logarithms are the library's.
  /// Source: Box and Muller, A note on the generation of random normal deviates, 1958.
  std::array<double, 4> normals(std::uint64_t sample, std::uint64_t channel) const;

 private:
  std::array<std::uint32_t, 2> key_;
};

}  // namespace nadir
