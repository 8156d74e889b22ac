#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "nadir/base/result.h"
#include "nadir/transfer/disk_cache.h"

namespace nadir::transfer {

/// Names in lower case; of several of one name, the last.
using Headers = std::map<std::string, std::string>;

/// What a server says before the body.
struct Head {
  int status = 0;
  Headers headers;

  /// Empty where there is no such line.
  std::string_view operator[](const std::string& name) const;
};

/// Adds the line "Name: value"; anything else is left out.
void add_header_line(std::string_view line, Headers& headers);

/// "bytes 0-99/1234", or "bytes */1234" for what cannot be served. RFC 9110, 14.4.
struct ContentRange {
  std::optional<std::uint64_t> first, last;  // both or none; last is inside
  std::optional<std::uint64_t> total;        // none for "*"
};
std::optional<ContentRange> parse_content_range(std::string_view text);

/// A whole number in decimal digits and nothing else.
std::optional<std::uint64_t> parse_digits(std::string_view text);

/// The answer's version of a file of `size` bytes.
FileVersion version_of(const Head& head, std::uint64_t size);

/// Whether an answer may come from the same bytes as `known`: equal size and ETag, or date where one of the two names
/// no ETag. One that names neither, where there was one before, may not.
bool may_be_same(const FileVersion& known, const FileVersion& answer);

/// `1234 bytes, ETag "x", Last-Modified Sat, 01 Aug 2026 ...`
std::string describe(const FileVersion& version);

/// "weak" ETags promise equal meaning, not equal bytes, and If-Match never matches them. RFC 9110, 13.1.1.
inline bool is_strong(std::string_view etag) { return !etag.empty() && !etag.starts_with("W/"); }

/// Statuses after which the same request may succeed.
bool is_passing(int status);

/// The error of a refusal, with what to do about it. `excerpt`: the start of what the server says about it, may be
/// empty.
Error refusal(const std::string& name, const Head& head, std::string_view excerpt);

/// Printable start of a body, in one line, for messages: the code and message of S3's XML where it is that.
std::string summary(std::string_view body);

}  // namespace nadir::transfer
