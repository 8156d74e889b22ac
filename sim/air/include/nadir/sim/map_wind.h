#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "nadir/sim/wind.h"
#include "nadir/tile/map.h"

namespace nadir::sim {

/// Wind from a raster of role `field`: bilinear between texel centres of level 0, m/s towards east and towards north.
///
/// Texels without data do not count: the others around the place share their weight, and where there is none the map
/// says nothing, which is calm. Reads blocks of the map as the flight comes to them and keeps the last four.
class MapWind final : public WindSource {
 public:
  enum class Outside {
    Edge,  // the wind of the nearest place on the map goes on
    Calm,  // the map adds nothing
  };

  /// `bands`: of the wind towards east and towards north; the first two where empty. Scale and offset of the bands
  /// apply. Fails where the map has another role, or the bands are not two.
  static Result<MapWind> create(tile::Map map, const std::vector<std::string>& bands, Outside outside);

  /// Fails where the map cannot be read there.
  Result<Eigen::Vector3d> towards_ned_mps(const AirPlace& place) override;

 private:
  struct Block {
    std::int32_t col = -1, row = -1;
    tile::Texels texels;
  };
  MapWind(tile::Map map, std::array<int, 2> bands, Outside outside)
      : map_(std::move(map)), bands_(bands), outside_(outside) {}
  Result<const Block*> block(std::int32_t col, std::int32_t row);

  tile::Map map_;
  std::array<int, 2> bands_;
  Outside outside_;
  std::array<Block, 4> blocks_;
  std::size_t oldest_ = 0;
};

std::string_view to_string(MapWind::Outside outside);  // "edge"
Result<MapWind::Outside> parse_outside(std::string_view name);

}  // namespace nadir::sim
