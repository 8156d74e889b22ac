// LZW as TIFF 6.0 section 13 has it: codes of 9 to 12 bits, high bits first, one bit longer a code early.
#include <array>
#include <cstdint>
#include <cstring>

#include "codecs.h"

namespace nadir::tiff {
namespace {

constexpr std::uint32_t clear_code = 256, end_code = 257, first_code = 258, most_codes = 4096;

/// A string of the table. Each is one byte longer than an earlier one and was written out when it was made: it lies in
/// the output, and is copied from there.
struct String {
  std::uint32_t at = 0, size = 0;
};

/// Codes from high bits to low. Past the end it gives zeros, and `exhausted` says so.
class BitReader {
 public:
  explicit BitReader(std::span<const std::byte> bytes)
      : next_(reinterpret_cast<const std::uint8_t*>(bytes.data())), end_(next_ + bytes.size()) {}

  std::uint32_t take(int bits) {
    if (held_ < bits) refill();
    held_ -= bits;
    return static_cast<std::uint32_t>(window_ >> held_) & ((1u << bits) - 1);
  }
  bool exhausted() const { return missing_ > held_; }

 private:
  void refill() {
    if (end_ - next_ >= 8) {
      std::uint64_t eight;
      std::memcpy(&eight, next_, 8);
      eight = __builtin_bswap64(eight);
      const int take = (63 - held_) / 8;  // whole bytes that fit: 6 or 7
      window_ = (window_ << (8 * take)) | (eight >> (64 - 8 * take));
      next_ += take;
      held_ += 8 * take;
      return;
    }
    while (held_ <= 48) {
      window_ <<= 8;
      if (next_ != end_)
        window_ |= *next_++;
      else
        missing_ += 8;
      held_ += 8;
    }
  }
  const std::uint8_t *next_, *end_;
  std::uint64_t window_ = 0;
  int held_ = 0, missing_ = 0;  // bits
};

}  // namespace

Result<void> unpack_lzw(std::span<const std::byte> packed, std::span<std::byte> out) {
  if (packed.size() >= 2 && packed[0] == std::byte{0} && (packed[1] & std::byte{1}) != std::byte{0})
    return damaged("LZW of the old kind, low bits first: convert it with gdal_translate");
  auto* const begin = reinterpret_cast<std::uint8_t*>(out.data());
  const std::size_t size = out.size();
  std::array<String, most_codes> table;
  BitReader codes(packed);
  std::uint32_t next = first_code, previous = clear_code;
  int bits = 9;
  String last;  // what was written last
  std::size_t done = 0;
  while (done < size) {
    const std::uint32_t code = codes.take(bits);
    if (codes.exhausted() || code == end_code) return damaged("LZW data end too early");
    if (code == clear_code) {
      next = first_code;
      previous = clear_code;
      bits = 9;
      continue;
    }
    // What the last string and the first byte of this one make is the table's next
    if (previous != clear_code && next < most_codes) table[next++] = {last.at, last.size + 1};
    String now{static_cast<std::uint32_t>(done), 1};
    if (code < clear_code) {
      begin[done++] = static_cast<std::uint8_t>(code);
    } else {
      if (code >= next) return damaged("LZW data hold a code that nothing defined");
      const String from = table[code];
      now.size = from.size;
      if (from.size > size - done) now.size = static_cast<std::uint32_t>(size - done);  // writers may round up
      const std::uint8_t* source = begin + from.at;
      std::uint8_t* to = begin + done;
      // A string that was just made ends with its own first byte, so that the two places may overlap by one: what is
      // copied sixteen bytes at a time must lie that far behind, and leave room for the last sixteen.
      if (done - from.at >= 16 && size - done >= now.size + 16u) {
        for (std::uint32_t i = 0; i < now.size; i += 16) std::memcpy(to + i, source + i, 16);
      } else {
        for (std::uint32_t i = 0; i < now.size; ++i) to[i] = source[i];
      }
      done += now.size;
    }
    last = now;
    previous = code;
    if (next + 1 >= (1u << bits) && bits < 12) ++bits;
  }
  return {};
}

}  // namespace nadir::tiff
