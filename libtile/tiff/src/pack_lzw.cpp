// LZW as TIFF 6.0 section 13 has it, as libtiff writes it: the table is begun anew when it is full.
#include <array>
#include <cstdint>
#include <vector>

#include "codecs.h"

namespace nadir::tiff {
namespace {

constexpr std::uint32_t clear_code = 256, end_code = 257, first_code = 258, last_code = 4094;

/// Codes to bytes, high bits first.
class BitWriter {
 public:
  explicit BitWriter(RawBytes& out) : out_(out) {}
  void put(std::uint32_t code, int bits) {
    window_ = window_ << bits | code;
    held_ += bits;
    while (held_ >= 8) {
      held_ -= 8;
      out_.push_back(static_cast<std::byte>(window_ >> held_ & 0xff));
    }
  }
  void finish() {
    if (held_ > 0) put(0, 8 - held_);
  }

 private:
  RawBytes& out_;
  std::uint64_t window_ = 0;
  int held_ = 0;
};

/// Which code stands for a known string with one byte more. Open addressing; entries of earlier tables are told apart
/// by their number.
class Table {
 public:
  void begin_anew() { ++generation_; }
  /// The code, else 0 and `slot` is where it would be entered.
  std::uint32_t find(std::uint32_t prefix, std::uint32_t byte, std::size_t& slot) const {
    const std::uint32_t key = prefix << 8 | byte;
    slot = (key * 2654435761u) >> (32 - bits);
    while (slots_[slot].generation == generation_) {
      if (slots_[slot].key == key) return slots_[slot].code;
      slot = (slot + 1) & (slots_.size() - 1);
    }
    return 0;
  }
  void enter(std::size_t slot, std::uint32_t prefix, std::uint32_t byte, std::uint32_t code) {
    slots_[slot] = {generation_, prefix << 8 | byte, code};
  }

 private:
  static constexpr int bits = 14;
  struct Slot {
    std::uint64_t generation = 0;
    std::uint32_t key = 0, code = 0;
  };
  std::vector<Slot> slots_ = std::vector<Slot>(std::size_t{1} << bits);
  std::uint64_t generation_ = 0;
};

}  // namespace

Result<void> pack_lzw(std::span<const std::byte> tile, RawBytes& out) {
  static thread_local Table table;
  BitWriter writer(out);
  int bits = 9;
  std::uint32_t next = first_code;
  const auto clear = [&] {
    writer.put(clear_code, bits);
    table.begin_anew();
    bits = 9;
    next = first_code;
  };
  // A code has been given to a string, or would have been.
  const auto count = [&] {
    if (++next == last_code)
      clear();
    else if (next > (1u << bits) - 1)
      ++bits;
  };
  clear();
  if (!tile.empty()) {
    auto string = static_cast<std::uint32_t>(tile.front());
    for (const std::byte b : tile.subspan(1)) {
      const auto byte = static_cast<std::uint32_t>(b);
      std::size_t slot = 0;
      if (const std::uint32_t longer = table.find(string, byte, slot)) {
        string = longer;
        continue;
      }
      writer.put(string, bits);
      table.enter(slot, string, byte, next);
      string = byte;
      count();
    }
    writer.put(string, bits);
    count();
  }
  writer.put(end_code, bits);
  writer.finish();
  return {};
}

}  // namespace nadir::tiff
