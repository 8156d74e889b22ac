#include "overlap.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <limits>
#include <map>
#include <numeric>

#include "nadir/base/text.h"
#include "nadir/geodesy/geodetic.h"

namespace nadir::mosaic {
namespace {

constexpr std::array<std::string_view, 5> names = {"last", "first", "newest", "oldest", "finest"};

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Takes a number of exactly so many digits from the front of `text`.
std::optional<int> take_number(std::string_view& text, std::size_t digits) {
  if (text.size() < digits || !std::all_of(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(digits), is_digit))
    return std::nullopt;
  int value = 0;
  for (std::size_t i = 0; i < digits; ++i) value = 10 * value + (text[i] - '0');
  text.remove_prefix(digits);
  return value;
}

void skip(std::string_view& text, std::string_view any_of) {
  if (!text.empty() && any_of.find(text.front()) != std::string_view::npos) text.remove_prefix(1);
}

/// Seconds east of UTC that the rest of a time says; empty where it says something else.
std::optional<int> parse_zone(std::string_view text) {
  text = trim(text);
  if (text.empty() || text == "Z" || text == "z" || text == "UTC") return 0;
  if (text.front() != '+' && text.front() != '-') return std::nullopt;
  const int sign = text.front() == '-' ? -1 : 1;
  text.remove_prefix(1);
  const auto hours = take_number(text, 2);
  skip(text, ":");
  const auto minutes = text.empty() ? std::optional(0) : take_number(text, 2);
  if (!hours || !minutes || !text.empty()) return std::nullopt;
  return sign * (*hours * 3600 + *minutes * 60);
}

/// Side of a texel at the middle of a raster, metres on the ellipsoid; infinite where that is not defined.
double texel_size_m(const RasterHeader& header,
                    std::map<std::string, std::optional<geodesy::Projection>>& projections) {
  constexpr double unknown = std::numeric_limits<double>::infinity();
  if (!header.description.georeference) return unknown;
  const tile::Georeference& where = *header.description.georeference;
  auto it = projections.find(where.definition);
  if (it == projections.end()) {
    auto made = geodesy::Projection::from_definition(where.definition);
    it = projections.emplace(where.definition, made ? std::optional(std::move(*made)) : std::nullopt).first;
  }
  if (!it->second) return unknown;
  const Eigen::Vector2d middle(header.description.levels.front().width * 0.5,
                               header.description.levels.front().height * 0.5);
  std::array<Eigen::Vector2d, 4> points = {middle - Eigen::Vector2d(0.5, 0), middle + Eigen::Vector2d(0.5, 0),
                                           middle - Eigen::Vector2d(0, 0.5), middle + Eigen::Vector2d(0, 0.5)};
  for (auto& p : points) p = where.crs_from_texel * p;
  it->second->lon_lat_from_crs(points);
  std::array<Eigen::Vector3d, 4> ecef;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].allFinite()) return unknown;
    ecef[i] = geodesy::ecef_from_geodetic({points[i].y(), points[i].x(), 0}).xyz;
  }
  return std::sqrt((ecef[1] - ecef[0]).norm() * (ecef[3] - ecef[2]).norm());
}

}  // namespace

std::string_view to_string(Overlap overlap) { return names[static_cast<std::size_t>(overlap)]; }
Result<Overlap> parse_overlap(std::string_view name) { return parse_name<Overlap>("overlap", name, names); }

std::optional<double> parse_time(std::string_view text) {
  text = trim(text);
  const auto year = take_number(text, 4);
  skip(text, "-:/");
  const auto month = take_number(text, 2);
  skip(text, "-:/");
  const auto day = take_number(text, 2);
  if (!year || !month || !day) return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year(*year), std::chrono::month(static_cast<unsigned>(*month)),
                                         std::chrono::day(static_cast<unsigned>(*day))};
  if (!date.ok()) return std::nullopt;
  double seconds = static_cast<double>(std::chrono::sys_days(date).time_since_epoch().count()) * 86400;
  skip(text, "Tt ");
  std::array<int, 3> clock{};
  for (int& part : clock) {
    if (text.empty() || !is_digit(text.front())) break;
    const auto number = take_number(text, 2);
    if (!number) return std::nullopt;
    part = *number;
    skip(text, ":");
  }
  seconds += clock[0] * 3600 + clock[1] * 60 + clock[2];
  if (text.starts_with('.')) {
    const auto end = std::find_if_not(text.begin() + 1, text.end(), is_digit);
    const auto fraction = parse_number(fmt::format("0{}", std::string_view(text.begin(), end)));
    if (!fraction) return std::nullopt;
    seconds += *fraction;
    text.remove_prefix(static_cast<std::size_t>(end - text.begin()));
  }
  const auto zone = parse_zone(text);
  if (!zone) return std::nullopt;
  return seconds - *zone;
}

std::vector<std::size_t> stack(std::span<const RasterHeader> headers, Overlap overlap,
                               std::vector<std::string>& warnings) {
  std::vector<std::size_t> order(headers.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (headers.size() < 2 || overlap == Overlap::Last) return order;
  if (overlap == Overlap::First) {
    std::reverse(order.begin(), order.end());
    return order;
  }

  // What lies low has a low rank
  constexpr double lowest = -std::numeric_limits<double>::infinity();
  std::vector<double> ranks;
  std::map<std::string, std::optional<geodesy::Projection>> projections;
  std::size_t undated = 0;
  std::string first_undated;
  for (const RasterHeader& header : headers) {
    if (overlap == Overlap::Finest) {
      ranks.push_back(-texel_size_m(header, projections));
      continue;
    }
    const auto time = parse_time(header.description.acquired);
    if (!time && undated++ == 0) first_undated = header.file.label;
    ranks.push_back(!time ? lowest : overlap == Overlap::Newest ? *time : -*time);
  }
  if (undated > 0)
    warnings.push_back(
        fmt::format("{} of {} sources tell no date and lie below the others, {} the first of them; give "
                    "them one with gdal_edit.py -mo NADIR_ACQUIRED=2024-05-17T10:20:30Z",
                    undated, headers.size(), first_undated));
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return ranks[a] < ranks[b]; });
  return order;
}

}  // namespace nadir::mosaic
