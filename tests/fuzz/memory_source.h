#pragma once

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "nadir/base/byte_source.h"

namespace nadir::fuzz {

/// A file that is only bytes in memory.
class MemorySource : public ByteSource {
 public:
  explicit MemorySource(std::vector<std::byte> bytes) : bytes_(std::move(bytes)) {}
  const std::string& name() const override { return name_; }
  std::uint64_t size() const override { return bytes_.size(); }
  Result<void> read(std::uint64_t offset, std::span<std::byte> out) const override {
    if (offset > bytes_.size() || out.size() > bytes_.size() - offset) return fail(Error::Kind::Io, "it ends");
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset), out.size(), out.begin());
    return {};
  }

 private:
  const std::vector<std::byte> bytes_;
  const std::string name_ = "memory";
};

}  // namespace nadir::fuzz
