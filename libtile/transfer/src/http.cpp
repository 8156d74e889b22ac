#include "http.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "nadir/base/text.h"

namespace nadir::transfer {
namespace {

std::string_view between(std::string_view text, std::string_view from, std::string_view to) {
  const std::size_t start = text.find(from);
  if (start == std::string_view::npos) return {};
  const std::size_t begin = start + from.size();
  const std::size_t end = text.find(to, begin);
  return end == std::string_view::npos ? std::string_view{} : text.substr(begin, end - begin);
}

const char* advice(int status) {
  switch (status) {
    case 401:
      return "it asks for credentials: check keys and tokens";
    case 403:
      return "access is refused: check keys, that a signed link has not expired, and the spelling, since some stores "
             "answer so for "
             "what does not exist";
    case 404:
      return "there is no such file: check the spelling";
    case 410:
      return "it has been removed: look for where it went";
    default:
      return "";
  }
}

}  // namespace

std::string_view Head::operator[](const std::string& name) const {
  const auto found = headers.find(name);
  return found == headers.end() ? std::string_view{} : found->second;
}

void add_header_line(std::string_view line, Headers& headers) {
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos) return;
  std::string name(trim(line.substr(0, colon)));
  std::transform(name.begin(), name.end(), name.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  headers[name] = trim(line.substr(colon + 1));
}

std::optional<std::uint64_t> parse_digits(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<ContentRange> parse_content_range(std::string_view text) {
  if (!text.starts_with("bytes")) return std::nullopt;
  text = trim(text.substr(5));
  const std::size_t slash = text.find('/');
  if (slash == std::string_view::npos) return std::nullopt;
  ContentRange range;
  if (const std::string_view total = trim(text.substr(slash + 1)); total != "*")
    if (range.total = parse_digits(total); !range.total) return std::nullopt;
  const std::string_view part = trim(text.substr(0, slash));
  if (part == "*") return range;
  const std::size_t dash = part.find('-');
  if (dash == std::string_view::npos) return std::nullopt;
  range.first = parse_digits(part.substr(0, dash));
  range.last = parse_digits(part.substr(dash + 1));
  if (!range.first || !range.last || *range.first > *range.last || (range.total && *range.last >= *range.total))
    return std::nullopt;
  return range;
}

FileVersion version_of(const Head& head, std::uint64_t size) {
  return {size, std::string(head["etag"]), std::string(head["last-modified"])};
}

bool may_be_same(const FileVersion& known, const FileVersion& answer) {
  if (known.size != answer.size) return false;
  if (!known.etag.empty() && !answer.etag.empty()) return known.etag == answer.etag;
  if (!known.last_modified.empty() && !answer.last_modified.empty()) return known.last_modified == answer.last_modified;
  return !known.can_be_checked();
}

std::string describe(const FileVersion& version) {
  std::string text = fmt::format("{} bytes", version.size);
  if (!version.etag.empty()) text += ", ETag " + version.etag;
  if (!version.last_modified.empty()) text += ", Last-Modified " + version.last_modified;
  return text;
}

bool is_passing(int status) {
  return status == 408 || status == 429 || status == 500 || status == 502 || status == 503 || status == 504;
}

std::string summary(std::string_view body) {
  if (const std::string_view code = between(body, "<Code>", "</Code>"); !code.empty())
    body = code;
  else if (trim(body).starts_with('<'))
    return {};  // a page for people: its text is somewhere further down
  std::string text;
  for (const char c : trim(body)) {
    if (text.size() >= 200) break;
    const bool blank = static_cast<unsigned char>(c) <= ' ' || c == 127;
    if (!blank)
      text += c;
    else if (!text.empty() && text.back() != ' ')
      text += ' ';
  }
  return text;
}

Error refusal(const std::string& name, const Head& head, std::string_view excerpt) {
  std::string message = fmt::format("{}: HTTP {}", name, head.status);
  if (const std::string said = summary(excerpt); !said.empty()) message += fmt::format(" ({})", said);
  if (const std::string_view region = head["x-amz-bucket-region"]; !region.empty() && head.status / 100 == 3)
    message += fmt::format(": the bucket lies in the region {}: set AWS_REGION={}", region, region);
  else if (head.status / 100 == 3)
    message += ": it is kept elsewhere, and signed requests are not sent on: use its new address";
  else if (const std::string_view text = advice(head.status); !text.empty())
    message += fmt::format(": {}", text);
  return {head.status == 404 || head.status == 410 ? Error::Kind::NotFound : Error::Kind::Io, message};
}

}  // namespace nadir::transfer
