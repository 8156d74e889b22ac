#include "nadir/base/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <numeric>

namespace nadir {
namespace {

/// Number of insertions, deletions, substitutions and swaps of neighbours between two words.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t j = 1; j <= b.size(); ++j) {
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  }
  return d[a.size()][b.size()];
}

}  // namespace

std::string nearest_name(std::string_view word, std::span<const std::string_view> candidates) {
  std::string_view best;
  std::size_t best_distance = std::max<std::size_t>(1, word.size() / 3) + 1;
  for (std::string_view candidate : candidates) {
    const std::size_t distance = edit_distance(word.substr(0, 64), candidate);
    if (distance < best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return std::string(best);
}

std::string suggestion(std::string_view word, std::span<const std::string_view> candidates) {
  const std::string near = nearest_name(word, candidates);
  if (!near.empty()) return fmt::format("; did you mean '{}'?", near);
  if (candidates.empty()) return "";
  return fmt::format("; known are {}", fmt::join(candidates, ", "));
}

std::string_view trim(std::string_view text) {
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.front()))) text.remove_prefix(1);
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.remove_suffix(1);
  return text;
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> fields;
  for (;;) {
    const std::size_t end = text.find(separator);
    fields.push_back(trim(text.substr(0, end)));
    if (end == std::string_view::npos) return fields;
    text.remove_prefix(end + 1);
  }
}

std::optional<double> parse_number(std::string_view text) {
  text = trim(text);
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

Result<std::int64_t> parse_seconds_as_ns(std::string_view text) {
  text = trim(text);
  std::string_view digits = text;
  const bool negative = !digits.empty() && digits.front() == '-';
  if (!digits.empty() && (digits.front() == '-' || digits.front() == '+')) digits.remove_prefix(1);
  const std::size_t point = std::min(digits.find('.'), digits.size());
  const std::string_view whole = digits.substr(0, point);
  const std::string_view fraction = digits.substr(std::min(point + 1, digits.size()));

  const auto all_digits = [](std::string_view s) {
    return std::all_of(s.begin(), s.end(), [](unsigned char c) { return std::isdigit(c); });
  };
  if (whole.size() + fraction.size() == 0 || !all_digits(whole) || !all_digits(fraction))
    return fail(Error::Kind::Malformed, fmt::format("'{}': expected seconds as a decimal number such as 12.05", text));
  if (fraction.size() > 9)
    return fail(Error::Kind::Malformed, fmt::format("'{}': time is kept in nanoseconds, at most 9 decimals", text));

  std::string nanoseconds(whole);
  nanoseconds += fraction;
  nanoseconds.append(9 - fraction.size(), '0');
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(nanoseconds.data(), nanoseconds.data() + nanoseconds.size(), value);
  if (error != std::errc())
    return fail(Error::Kind::Malformed, fmt::format("'{}': more seconds than 64-bit nanoseconds hold", text));
  return negative ? -value : value;
}

std::string format_bytes(std::uint64_t bytes) {
  if (bytes < 1024) return fmt::format("{} bytes", bytes);
  double value = static_cast<double>(bytes);
  const char* unit = "";
  for (const char* next : {"KiB", "MiB", "GiB", "TiB"}) {
    if (value < 1024) break;
    value /= 1024;
    unit = next;
  }
  return fmt::format("{:.{}f} {}", value, value < 10 ? 1 : 0, unit);
}

Result<std::uint64_t> parse_bytes(std::string_view text) {
  const std::string_view whole = trim(text);
  std::string_view number = whole;
  while (!number.empty() && std::isalpha(static_cast<unsigned char>(number.back()))) number.remove_suffix(1);
  std::string_view unit = whole.substr(number.size());

  int power = 0;
  if (!unit.empty()) {
    const char letter = static_cast<char>(std::toupper(static_cast<unsigned char>(unit.front())));
    power = static_cast<int>(std::string_view("BKMGT").find(letter));
    const std::string_view rest = unit.substr(1);
    if (!(rest.empty() || (power > 0 && (rest == "iB" || rest == "B")))) power = -1;
  }
  const auto value = parse_number(number);
  if (!value || power < 0 || *value < 0 || *value * std::exp2(10 * power) > 1e18)
    return fail(Error::Kind::Malformed, fmt::format("'{}': expected an amount of memory such as 256MiB or 2GiB", text));
  return static_cast<std::uint64_t>(*value * std::exp2(10 * power));
}

}  // namespace nadir
