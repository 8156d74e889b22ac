#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <list>
#include <memory>
#include <mutex>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include "nadir/base/byte_source.h"
#include "nadir/tiff/tiff_file.h"

namespace nadir::tiff {

/// Headers and tables, read in pages of which the last used are kept.
/// Thread-safe.
class Pages {
 public:
  explicit Pages(std::shared_ptr<const ByteSource> source) : source_(std::move(source)) {}
  const ByteSource& source() const { return *source_; }

  /// Reads what is not held of all ranges at once, then `read` finds it.
  Result<void> prepare(std::span<const TilePlace> ranges) {
    std::set<std::uint64_t> missing;
    {
      std::scoped_lock lock(mutex_);
      for (const TilePlace& range : ranges)
        for (std::uint64_t p = range.offset / page_bytes; p * page_bytes < range.offset + range.size; ++p)
          if (!held_.contains(p)) missing.insert(p);
    }
    if (missing.empty()) return {};
    std::vector<std::pair<std::uint64_t, Page>> pages;
    std::vector<ByteRequest> requests;
    for (const std::uint64_t p : missing) {
      if (p * page_bytes >= source_->size()) break;
      const auto size = static_cast<std::size_t>(std::min(page_bytes, source_->size() - p * page_bytes));
      auto page = std::make_shared<std::vector<std::byte>>(size);
      requests.push_back({p * page_bytes, *page});
      pages.emplace_back(p, std::move(page));
    }
    if (auto ok = source_->read_many(requests); !ok) return ok;
    std::scoped_lock lock(mutex_);
    for (auto& [p, page] : pages) keep(p, std::move(page));
    return {};
  }

  Result<void> read(std::uint64_t offset, std::span<std::byte> out) {
    if (offset > source_->size() || out.size() > source_->size() - offset)
      return fail(Error::Kind::Malformed, fmt::format("{}: expected {} bytes at {}, the file has {}", source_->name(),
                                                      out.size(), offset, source_->size()));
    while (!out.empty()) {
      const std::uint64_t p = offset / page_bytes;
      const auto page = get(p);
      if (!page) return fail(page);
      const auto at = static_cast<std::size_t>(offset - p * page_bytes);
      const std::size_t n = std::min(out.size(), (*page)->size() - at);
      std::memcpy(out.data(), (*page)->data() + at, n);
      offset += n;
      out = out.subspan(n);
    }
    return {};
  }

 private:
  using Page = std::shared_ptr<std::vector<std::byte>>;
  static constexpr std::uint64_t page_bytes = 16 << 10;
  static constexpr std::size_t most_pages = 128;

  Result<Page> get(std::uint64_t p) {
    {
      std::scoped_lock lock(mutex_);
      if (const auto it = held_.find(p); it != held_.end()) {
        by_age_.splice(by_age_.begin(), by_age_, it->second.second);
        return it->second.first;
      }
    }
    const auto size = static_cast<std::size_t>(std::min(page_bytes, source_->size() - p * page_bytes));
    auto page = std::make_shared<std::vector<std::byte>>(size);
    if (auto ok = source_->read(p * page_bytes, *page); !ok) return fail(ok);
    std::scoped_lock lock(mutex_);
    keep(p, page);
    return page;
  }

  void keep(std::uint64_t p, Page page) {  // with mutex_ held
    if (held_.contains(p)) return;
    by_age_.push_front(p);
    held_[p] = {std::move(page), by_age_.begin()};
    if (by_age_.size() <= most_pages) return;
    held_.erase(by_age_.back());
    by_age_.pop_back();
  }

  const std::shared_ptr<const ByteSource> source_;
  std::mutex mutex_;  // guards what follows; never held while reading
  std::unordered_map<std::uint64_t, std::pair<Page, std::list<std::uint64_t>::iterator>> held_;
  std::list<std::uint64_t> by_age_;  // last used first
};

}  // namespace nadir::tiff
