#include "range_exchange.h"

#include <fmt/format.h>

#include <algorithm>

#include "nadir/base/text.h"

namespace nadir::transfer {

RangeExchange::RangeExchange(std::shared_ptr<const Endpoint> to, std::shared_ptr<Batch> batch, std::uint64_t offset,
                             std::uint64_t size, const FileVersion& known)
    : Exchange(std::move(to), std::move(batch)), offset_(offset), size_(size), known_(known), opening_(false) {}

RangeExchange::RangeExchange(std::shared_ptr<const Endpoint> to, std::shared_ptr<Batch> batch, std::uint64_t size,
                             std::optional<FileVersion> cached)
    : Exchange(std::move(to), std::move(batch)), offset_(0), size_(size), cached_(std::move(cached)), opening_(true) {}

Outgoing RangeExchange::next_try() {
  refused_.reset();
  excerpt_.clear();
  if (whole_position_ || data_.size() >= size_)
    data_.clear();  // the server starts anew; or all came, and was not to be trusted
  whole_position_.reset();

  Outgoing outgoing;
  outgoing.range = fmt::format("{}-{}", offset_ + data_.size(), offset_ + std::max<std::uint64_t>(size_, 1) - 1);
  if (known_ && if_match_ && is_strong(known_->etag)) outgoing.headers.push_back("If-Match: " + known_->etag);
  if (!known_ && cached_)
    outgoing.headers.push_back(cached_->etag.empty() ? "If-Modified-Since: " + cached_->last_modified
                                                     : "If-None-Match: " + cached_->etag);
  return outgoing;
}

Verdict RangeExchange::fail_with(Error::Kind kind, std::string message) {
  error = Error{kind, std::move(message)};
  return Verdict::Failed;
}

Verdict RangeExchange::misfit(Error::Kind kind, std::string message) {
  if (misfitted_) return fail_with(kind, std::move(message));
  misfitted_ = true;
  return Verdict::Again;
}

Verdict RangeExchange::changed(const FileVersion& now) {
  return fail_with(Error::Kind::Io,
                   fmt::format("{}: changed while it was read: it had {}; now it has {}; open it again", name(),
                               describe(*known_), describe(now)));
}

Verdict RangeExchange::head(const Head& head) {
  switch (head.status) {
    case 206:
      return partial(head);
    case 200:
      return whole(head);
    case 304:
      if (!opening_ || !cached_) break;
      not_modified_ = true;
      known_ = cached_;
      return Verdict::Proceed;
    case 412:  // the file is another, or the server is odd about If-Match: ask without, and compare what comes
      if (!known_ || !if_match_) break;
      if_match_ = false;
      return Verdict::Again;
    case 416: {
      const auto range = parse_content_range(head["content-range"]);
      const auto total = range ? range->total : std::nullopt;
      if (opening_ && total.value_or(1) == 0 && (!known_ || known_->size == 0)) {
        known_ = version_of(head, 0);
        size_ = 0;
        whole_position_ = 0;  // whatever the body says is no part of the file
        return Verdict::Proceed;
      }
      if (known_ && total && *total != known_->size) return changed(version_of(head, *total));
      return fail_with(
          Error::Kind::Io,
          fmt::format("{}: HTTP 416: the server says that it has no bytes {}-{}: the file may have been replaced; "
                      "open it again",
                      name(), offset_ + data_.size(), offset_ + size_ - 1));
    }
    default:
      break;
  }
  refused_ = head;
  return Verdict::Proceed;
}

Verdict RangeExchange::partial(const Head& head) {
  const auto range = parse_content_range(head["content-range"]);
  const std::uint64_t first = offset_ + data_.size();
  if (!range || !range->first)
    return misfit(Error::Kind::Io, fmt::format("{}: expected Content-Range 'bytes {}-{}/...', found '{}'", name(),
                                               first, offset_ + size_ - 1, head["content-range"]));
  if (!range->total && !known_)
    return fail_with(Error::Kind::Unsupported,
                     fmt::format("{}: the server does not tell the file's size (Content-Range '{}')", name(),
                                 head["content-range"]));
  const FileVersion now = version_of(head, range->total.value_or(known_ ? known_->size : 0));
  if (known_ && !may_be_same(*known_, now)) return changed(now);
  const std::uint64_t last = std::min(offset_ + size_, now.size) - 1;
  if (range->first != first || range->last != last)
    return misfit(Error::Kind::Io,
                  fmt::format("{}: asked for bytes {}-{}, and the server sent bytes {}-{}, twice: a proxy or "
                              "mirror on the way may be broken",
                              name(), first, last, *range->first, *range->last));
  known_ = now;
  size_ = last + 1 - offset_;
  data_.reserve(size_);
  return Verdict::Proceed;
}

Verdict RangeExchange::whole(const Head& head) {
  const std::optional<std::uint64_t> length =
      head["content-encoding"].empty() ? parse_digits(head["content-length"]) : std::nullopt;
  const std::uint64_t expected = length.value_or(known_ ? known_->size : 0);
  if (expected > most_unasked_bytes)
    return fail_with(
        Error::Kind::Unsupported,
        fmt::format("{}: the server ignores ranges and would send all of the file's {} for a few of its bytes: use a "
                    "server that supports range requests, or download the file",
                    name(), format_bytes(expected)));
  const FileVersion now = version_of(head, expected);
  if (known_ && !may_be_same(*known_, now)) return changed(now);
  data_.clear();
  whole_position_ = 0;
  if (!opening_) return Verdict::Proceed;
  known_ = now;
  if (!length) known_->size = most_unasked_bytes;  // until the end tells
  size_ = known_->size;
  return Verdict::Proceed;
}

Verdict RangeExchange::bytes(std::span<const std::byte> bytes) {
  if (refused_) {
    excerpt_.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return excerpt_.size() < 4096 ? Verdict::Proceed : end();
  }
  if (not_modified_ || size_ == 0) return Verdict::Proceed;
  if (!whole_position_) {
    if (data_.size() + bytes.size() > size_) {
      data_.clear();
      return misfit(Error::Kind::Io,
                    fmt::format("{}: sent more bytes than bytes {}-{} have", name(), offset_, offset_ + size_ - 1));
    }
    data_.insert(data_.end(), bytes.begin(), bytes.end());
    return Verdict::Proceed;
  }

  // Keep the part of the file that was asked for.
  const std::uint64_t begin = *whole_position_;
  const std::uint64_t end = begin + bytes.size();
  whole_position_ = end;
  if (end > known_->size)
    return fail_with(Error::Kind::Unsupported,
                     fmt::format("{}: the server ignores ranges and sends more than the {} expected: use "
                                 "a server that supports range requests, or download the file",
                                 name(), format_bytes(known_->size)));
  const std::uint64_t from = std::max(begin, offset_), to = std::min(end, offset_ + size_);
  if (from < to)
    data_.insert(data_.end(), bytes.begin() + static_cast<std::ptrdiff_t>(from - begin),
                 bytes.begin() + static_cast<std::ptrdiff_t>(to - begin));
  return Verdict::Proceed;
}

Verdict RangeExchange::end() {
  if (refused_) {
    error = refusal(name(), *refused_, excerpt_);
    return Verdict::Failed;
  }
  if (not_modified_) return Verdict::Proceed;
  if (whole_position_ && opening_ && size_ == most_unasked_bytes) known_->size = size_ = data_.size();
  if (data_.size() < size_ || (whole_position_ && size_ > 0 && *whole_position_ != known_->size))
    return Verdict::Broken;
  return Verdict::Proceed;
}

}  // namespace nadir::transfer
