#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "nadir/base/result.h"

namespace nadir {

/// The candidate that a mistyped `word` most likely meant: the smallest edit distance, if that is
/// at most a third of the word's length (and at least 1); empty where nothing is near.
std::string nearest_name(std::string_view word, std::span<const std::string_view> candidates);

/// "; did you mean 'lat_deg'?", or the list of what is allowed where nothing is near.
std::string suggestion(std::string_view word, std::span<const std::string_view> candidates);

/// The enumerator whose place in `names` holds `name`; `what` is for the message: "role".
template <class Enum, std::size_t N>
Result<Enum> parse_name(std::string_view what, std::string_view name, const std::array<std::string_view, N>& names) {
  for (std::size_t i = 0; i < N; ++i)
    if (names[i] == name) return static_cast<Enum>(i);
  return fail(Error::Kind::NotFound,
              "no " + std::string(what) + " '" + std::string(name) + "'" + suggestion(name, names));
}

/// The finite number that the whole of `text` (blanks around it allowed) spells, independent of locale.
std::optional<double> parse_number(std::string_view text);

/// Nanoseconds of a decimal number of seconds, exact: parsed as text, never through double.
/// More than nine decimals are an error, as is what does not fit int64 (292 years).
Result<std::int64_t> parse_seconds_as_ns(std::string_view text);

/// `text` without blanks at both ends.
std::string_view trim(std::string_view text);

/// Fields of `text` between `separator`s, trimmed. An empty text has one empty field.
std::vector<std::string_view> split(std::string_view text, char separator);

/// "1.5 GiB", "812 KiB", "17 bytes".
std::string format_bytes(std::uint64_t bytes);

/// Bytes of "256MiB", "1.5 GiB", "512M", "4096": powers of 1024 for K, M, G, T with or without iB.
Result<std::uint64_t> parse_bytes(std::string_view text);

}  // namespace nadir
