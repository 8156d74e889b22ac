#include "nadir/base/random.h"

#include <cmath>
#include <numbers>

namespace nadir {
namespace {

/// Every bit of the result depends on every bit of `x`, and no two results agree.
/// Source: Steele, Lea and Flood, Fast splittable pseudorandom number generators, 2014 (SplitMix64).
std::uint64_t mixed(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

std::uint32_t low(std::uint64_t x) { return static_cast<std::uint32_t>(x); }
std::uint32_t high(std::uint64_t x) { return static_cast<std::uint32_t>(x >> 32); }

/// In (0, 1), the middle of each step of 2^-32.
double unit(std::uint32_t bits) { return (bits + 0.5) * 0x1p-32; }

}  // namespace

std::array<std::uint32_t, 4> philox_4x32_10(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key) {
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t a = std::uint64_t{0xD2511F53u} * counter[0], b = std::uint64_t{0xCD9E8D57u} * counter[2];
    counter = {high(b) ^ counter[1] ^ key[0], low(b), high(a) ^ counter[3] ^ key[1], low(a)};
    key = {key[0] + 0x9E3779B9u, key[1] + 0xBB67AE85u};
  }
  return counter;
}

RandomStream::RandomStream(std::uint64_t seed, std::string_view name) {
  std::uint64_t hash = mixed(seed);
  for (const char c : name) hash = mixed(hash + static_cast<unsigned char>(c) + 1);
  key_ = {low(hash), high(hash)};
}

std::array<std::uint32_t, 4> RandomStream::bits(std::uint64_t sample, std::uint64_t channel) const {
  return philox_4x32_10({low(sample), high(sample), low(channel), high(channel)}, key_);
}

std::array<double, 4> RandomStream::normals(std::uint64_t sample, std::uint64_t channel) const {
  const auto random = bits(sample, channel);
  std::array<double, 4> out;
  for (std::size_t i = 0; i < 4; i += 2) {
    const double radius = std::sqrt(-2 * std::log(unit(random[i])));
    const double angle = 2 * std::numbers::pi * unit(random[i + 1]);
    out[i] = radius * std::cos(angle);
    out[i + 1] = radius * std::sin(angle);
  }
  return out;
}

}  // namespace nadir
