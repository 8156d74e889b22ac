#include "nadir/render/geographic_polygon.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <utility>

#include "nadir/geodesy/geodetic.h"

namespace nadir::render {
namespace {

// Whole nanodegrees: whether a place lies on the antimeridian or at a pole is exact.
constexpr std::int64_t per_degree = 1'000'000'000, half_turn = 180 * per_degree, turn = 2 * half_turn,
                       pole = 90 * per_degree;

struct Place {
  std::int64_t lon, lat;
  friend bool operator==(const Place&, const Place&) = default;
};
using Ring = std::vector<Place>;

/// The remainder of a longitude in (-180, 180] degrees.
std::int64_t wrapped(std::int64_t lon) {
  lon %= turn;
  return lon > half_turn ? lon - turn : lon <= -half_turn ? lon + turn : lon;
}

bool at_pole(const Place& p) { return std::abs(p.lat) == pole; }
bool on_antimeridian(const Place& p) { return wrapped(p.lon) == half_turn; }

/// Counter-clockwise, in nanodegrees, without repetitions.
Ring rounded(const Outline& outline) {
  const auto nano = [](double radians) {
    return static_cast<std::int64_t>(std::llround(geodesy::to_degrees(radians) * per_degree));
  };
  Ring ring;
  const auto same = [](const Place& a, const Place& b) { return a.lat == b.lat && (a.lon == b.lon || at_pole(a)); };
  for (auto p = outline.rbegin(); p != outline.rend(); ++p) {
    if (!p->allFinite()) continue;
    const Place place{wrapped(nano(p->x())), std::clamp(nano(p->y()), -pole, pole)};
    if (ring.empty() || !same(ring.back(), place)) ring.push_back(place);
  }
  while (ring.size() > 1 && same(ring.front(), ring.back())) ring.pop_back();
  return ring;
}

/// The ring with the poles that its lines pass as points of their own.
Ring with_passed_poles(const Ring& ring) {
  Ring result;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Place &a = ring[i], &b = ring[(i + 1) % ring.size()];
    result.push_back(a);
    if (!at_pole(a) && !at_pole(b) && std::abs(a.lon - b.lon) == half_turn)
      result.push_back({0, a.lat + b.lat < 0 ? -pole : pole});
  }
  return result;
}

/// The ring on a map that goes on to the east and to the west, closed: its last place is the first but for whole turns.
/// A pole is a line there: from the longitude on which the ring reaches it to that on which it leaves, around the side
/// where the area lies.
Ring unrolled(const Ring& ring) {
  const auto first = std::find_if_not(ring.begin(), ring.end(), at_pole);
  Ring result;
  if (first == ring.end()) return result;
  const std::size_t n = ring.size(), start = static_cast<std::size_t>(first - ring.begin());
  result.push_back(*first);
  for (std::size_t i = 1; i <= n; ++i) {
    const Place& p = ring[(start + i) % n];
    const std::int64_t lon = result.back().lon;
    if (!at_pole(p)) {
      result.push_back({lon + wrapped(p.lon - lon), p.lat});
      continue;
    }
    // The area lies to the left: westwards of who comes north
    const Place& next = ring[(start + i + 1) % n];
    std::int64_t along = wrapped(next.lon - lon);
    if (p.lat > 0 && along > 0) along -= turn;
    if (p.lat < 0 && along < 0) along += turn;
    result.push_back({lon, p.lat});
    if (along != 0) result.push_back({lon + along, p.lat});
  }
  return result;
}

/// The ring with a point wherever a line meets the antimeridian.
Ring with_antimeridians(const Ring& unrolled) {
  Ring result;
  for (std::size_t i = 0; i + 1 < unrolled.size(); ++i) {
    const Place &a = unrolled[i], &b = unrolled[i + 1];
    result.push_back(a);
    const std::int64_t step = b.lon > a.lon ? 1 : -1;
    // Of the antimeridians between a and b, from the one next to a
    const auto index = [&](std::int64_t lon) {  // of the last antimeridian at lon or to the west of it
      return static_cast<std::int64_t>(std::floor(static_cast<double>(lon - half_turn) / static_cast<double>(turn)));
    };
    std::int64_t line = (step > 0 ? index(a.lon) + 1 : index(a.lon - 1)) * turn + half_turn;
    for (; (b.lon - line) * step > 0; line += step * turn) {
      const double share = static_cast<double>(line - a.lon) / static_cast<double>(b.lon - a.lon);
      result.push_back({line, a.lat + std::llround(share * static_cast<double>(b.lat - a.lat))});
    }
  }
  result.push_back(unrolled.back());
  return result;
}

/// Moves places by whole turns so that those between the antimeridians around `inner` lie within [-180, 180].
void onto_map(Ring& places, std::int64_t inner) {
  const std::int64_t shift = wrapped(inner) - inner;
  for (Place& p : places) p.lon += shift;
}

/// From one place on the antimeridian to the next, with none between.
struct Piece {
  Ring places;
  bool used = false;
};

/// Where a piece starts or ends on the map's western or eastern side.
struct Post {
  std::size_t piece;
  bool starts;
  std::int64_t lat;
  double slope;  // of latitude, from the side inwards: tells the order of those at one latitude

  friend bool operator<(const Post& a, const Post& b) { return std::pair(a.lat, a.slope) < std::pair(b.lat, b.slope); }
};

Post post_of(const Ring& places, std::size_t piece, bool starts) {
  const Place side = starts ? places.front() : places.back();
  const Place inner = starts ? places[1] : places[places.size() - 2];
  return {piece, starts, side.lat,
          static_cast<double>(inner.lat - side.lat) / static_cast<double>(std::abs(inner.lon - side.lon))};
}

/// Joins pieces along the map's sides. With the area to the left, what ends on the eastern side goes on northwards to
/// the next start, and on the western side southwards. Empty where that does not close.
std::vector<Ring> joined(std::vector<Piece>& pieces) {
  std::vector<Post> east, west;
  for (std::size_t i = 0; i < pieces.size(); ++i)
    for (const bool starts : {true, false}) {
      const Post post = post_of(pieces[i].places, i, starts);
      const Place& side = starts ? pieces[i].places.front() : pieces[i].places.back();
      (side.lon > 0 ? east : west).push_back(post);
    }
  std::sort(east.begin(), east.end());
  std::sort(west.begin(), west.end());
  std::reverse(west.begin(), west.end());
  const auto next = [&](std::size_t piece) -> std::optional<std::size_t> {
    const auto& posts = pieces[piece].places.back().lon > 0 ? east : west;
    auto post = std::find_if(posts.begin(), posts.end(), [&](const Post& p) { return p.piece == piece && !p.starts; });
    if (++post == posts.end() || !post->starts) return std::nullopt;
    return post->piece;
  };

  std::vector<Ring> rings;
  for (std::size_t first = 0; first < pieces.size(); ++first) {
    if (pieces[first].used) continue;
    Ring ring;
    for (std::optional<std::size_t> i = first; !pieces[*i].used;) {
      pieces[*i].used = true;
      ring.insert(ring.end(), pieces[*i].places.begin(), pieces[*i].places.end());
      i = next(*i);
      if (!i) return {};
    }
    rings.push_back(std::move(ring));
  }
  return rings;
}

/// The rings that a ring falls into where it comes back to a place.
std::vector<Ring> parted(const Ring& ring) {
  std::vector<Ring> parts;
  Ring open;
  for (const Place& p : ring) {
    const auto before = std::find(open.begin(), open.end(), p);
    if (before == open.end()) {
      open.push_back(p);
      continue;
    }
    parts.emplace_back(before, open.end());
    open.erase(before + 1, open.end());
  }
  parts.push_back(std::move(open));
  return parts;
}

/// Positive where counter-clockwise.
double area(const Ring& ring) {
  double sum = 0;
  for (std::size_t i = 1; i + 1 < ring.size(); ++i)
    sum += static_cast<double>(ring[i].lon - ring[0].lon) * static_cast<double>(ring[i + 1].lat - ring[0].lat) -
           static_cast<double>(ring[i + 1].lon - ring[0].lon) * static_cast<double>(ring[i].lat - ring[0].lat);
  return sum;
}

/// Even-odd rule.
bool within(const Place& p, const Ring& ring) {
  bool inside = false;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Place &a = ring[i], &b = ring[(i + 1) % ring.size()];
    if ((a.lat > p.lat) == (b.lat > p.lat)) continue;
    const double share = static_cast<double>(p.lat - a.lat) / static_cast<double>(b.lat - a.lat);
    inside ^= static_cast<double>(p.lon - a.lon) < share * static_cast<double>(b.lon - a.lon);
  }
  return inside;
}

GeographicRing closed(const Ring& ring) {
  GeographicRing result;
  for (const Place& p : ring)
    result.emplace_back(static_cast<double>(p.lon) / per_degree, static_cast<double>(p.lat) / per_degree);
  result.push_back(result.front());
  return result;
}

}  // namespace

std::vector<GeographicPolygon> geographic_polygons(std::span<const Outline> outlines) {
  std::vector<Ring> rings;
  std::vector<Piece> pieces;
  std::int64_t turns = 0;  // eastwards, of all outlines
  for (const Outline& outline : outlines) {
    Ring ring = unrolled(with_passed_poles(rounded(outline)));
    if (ring.empty()) continue;
    turns += (ring.back().lon - ring.front().lon) / turn;
    ring = with_antimeridians(ring);
    const auto cut = std::find_if(ring.begin(), ring.end(), on_antimeridian);
    if (cut == ring.end()) {
      onto_map(ring, ring.front().lon);
      rings.push_back(std::move(ring));
      continue;
    }
    // From antimeridian to antimeridian; what runs along one comes back when pieces are joined
    const std::int64_t around = ring.back().lon - ring.front().lon;
    Ring from_cut(cut, ring.end());
    for (auto p = ring.begin() + 1; p <= cut; ++p) from_cut.push_back({p->lon + around, p->lat});
    Ring places;
    for (const Place& p : from_cut) {
      places.push_back(p);
      if (places.size() == 1 || !on_antimeridian(p)) continue;
      if (places.size() > 2) {
        onto_map(places, places[1].lon);
        pieces.push_back({std::move(places)});
      }
      places = {p};
    }
  }
  // A pole within is all of the map's upper or lower side
  if (turns == 1) pieces.push_back({{{half_turn, pole}, {0, pole}, {-half_turn, pole}}});
  if (turns == -1) pieces.push_back({{{-half_turn, -pole}, {0, -pole}, {half_turn, -pole}}});
  for (Ring& ring : joined(pieces)) rings.push_back(std::move(ring));

  std::vector<Ring> parts;
  for (const Ring& ring : rings)
    for (Ring& part : parted(ring)) parts.push_back(std::move(part));
  std::vector<std::pair<GeographicPolygon, Ring>> polygons;  // each with what surrounds it
  for (const Ring& ring : parts)
    if (area(ring) > 0) polygons.push_back({{closed(ring)}, ring});
  for (const Ring& ring : parts) {
    if (!(area(ring) < 0)) continue;
    const auto around = std::find_if(polygons.begin(), polygons.end(), [&](const auto& polygon) {
      // By a place that is not on both
      const auto place = std::find_if_not(ring.begin(), ring.end(), [&](const Place& p) {
        return std::find(polygon.second.begin(), polygon.second.end(), p) != polygon.second.end();
      });
      return place != ring.end() && within(*place, polygon.second);
    });
    if (around != polygons.end()) around->first.push_back(closed(ring));
  }
  std::vector<GeographicPolygon> result;
  for (auto& [polygon, surround] : polygons) result.push_back(std::move(polygon));
  return result;
}

std::vector<GeographicPolygon> geographic_polygons(const Footprint& footprint) {
  std::vector<Outline> outlines = {footprint.outline_lon_lat_rad};
  outlines.insert(outlines.end(), footprint.more_outlines_lon_lat_rad.begin(),
                  footprint.more_outlines_lon_lat_rad.end());
  return geographic_polygons(outlines);
}

}  // namespace nadir::render
