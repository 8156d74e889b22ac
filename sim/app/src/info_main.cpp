// nadir info: what a map is, from its headers.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "command.h"
#include "info_check.h"
#include "nadir/base/text.h"
#include "nadir/tile/map.h"

namespace nadir::app {
namespace {

using Json = nlohmann::ordered_json;
using tile::MapDescription;

constexpr const char* validity_names[] = {"every texel", "nodata value", "mask", "alpha band"};

std::string lat_lon(const geodesy::Geodetic& place) {
  return fmt::format("{:.7f}, {:.7f}", geodesy::to_degrees(place.lat_rad), geodesy::to_degrees(place.lon_rad));
}

void print_bands(const MapDescription& map) {
  constexpr std::size_t most = 32;
  for (std::size_t i = 0; i < std::min(map.bands.size(), most); ++i) {
    const tile::Band& band = map.bands[i];
    fmt::print("  {:>3}  {:<9} {:<10} {}{}{}\n", i + 1, band.stored_type, band.color, band.name,
               band.nodata ? fmt::format("  nodata {}", *band.nodata) : "", band.unit.empty() ? "" : "  " + band.unit);
  }
  if (map.bands.size() > most) fmt::print("  ... {} more\n", map.bands.size() - most);
}

void print_text(const MapDescription& map, const Result<tile::Map>& opened) {
  fmt::print("{}\n  {}{}{}\n", map.path, map.format, map.layout.empty() ? "" : ", " + map.layout,
             map.compression.empty() ? ", not compressed" : ", " + map.compression);
  if (opened) {
    const Eigen::Vector2d texel = opened->texel_size_m();
    fmt::print("  {}, centre {} (lat, lon in degrees)\n", map.georeference->crs, lat_lon(opened->center()));
    fmt::print("  texel {:.6g} x {:.6g} m on the ground, map {:.6g} x {:.6g} m\n", texel.x(), texel.y(),
               texel.x() * opened->width(), texel.y() * opened->height());
  }
  fmt::print("levels\n");
  for (std::size_t k = 0; k < map.levels.size(); ++k) {
    const tile::Level& level = map.levels[k];
    fmt::print("  {:>3}  {} x {}, tiles of {} x {}\n", k, level.width, level.height, level.tile_width,
               level.tile_height);
  }
  fmt::print("bands, valid by {}\n", validity_names[static_cast<int>(map.validity)]);
  print_bands(map);
  for (const auto& [label, value] : {std::pair("role", map.role),
                                     {"acquired", map.acquired},
                                     {"attribution", map.attribution},
                                     {"licence", map.licence}})
    if (!value.empty()) fmt::print("{}: {}\n", label, value);
  for (const std::string& warning : map.warnings) fmt::print("note: {}\n", warning);
  if (!opened && map.georeference) fmt::print("note: cannot be rendered: {}\n", opened.error().message);
}

Json to_json(const MapDescription& map, const Result<tile::Map>& opened) {
  Json levels = Json::array(), bands = Json::array();
  for (const tile::Level& level : map.levels)
    levels.push_back({{"width", level.width},
                      {"height", level.height},
                      {"tile_width", level.tile_width},
                      {"tile_height", level.tile_height}});
  for (const tile::Band& band : map.bands) {
    Json b = {{"name", band.name}, {"type", band.stored_type}, {"color", band.color},
              {"unit", band.unit}, {"scale", band.scale},      {"offset", band.offset}};
    if (!band.nodata)
      b["nodata"] = nullptr;
    else if (std::isfinite(*band.nodata))
      b["nodata"] = *band.nodata;
    else
      b["nodata"] = fmt::format("{}", *band.nodata);  // JSON has no NaN
    bands.push_back(std::move(b));
  }
  Json json = {{"path", map.path},
               {"format", map.format},
               {"layout", map.layout},
               {"compression", map.compression},
               {"levels", levels},
               {"bands", bands},
               {"validity", validity_names[static_cast<int>(map.validity)]},
               {"role", map.role},
               {"acquired", map.acquired},
               {"attribution", map.attribution},
               {"licence", map.licence},
               {"notes", map.warnings}};
  if (map.georeference) {
    const Eigen::Matrix3d m = map.georeference->crs_from_texel.matrix();
    json["crs"] = map.georeference->crs;
    if (opened) json["wkt"] = opened->projection().wkt().value_or("");
    json["crs_from_texel"] = {m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2)};
  }
  json["renderable"] = opened.has_value();
  if (opened) {
    json["center"] = {{"lat_deg", geodesy::to_degrees(opened->center().lat_rad)},
                      {"lon_deg", geodesy::to_degrees(opened->center().lon_rad)}};
    json["texel_size_m"] = {opened->texel_size_m().x(), opened->texel_size_m().y()};
  } else {
    json["problem"] = opened.error().message;
  }
  return json;
}

}  // namespace
}  // namespace nadir::app

int main(int argc, char** argv) {
  using namespace nadir;
  CLI::App app("What a map is: size, levels, CRS, scale on the ground, bands, and what to mind.", "nadir info");
  std::string path;
  bool json = false, check = false;
  app.add_option("MAP", path, "any raster that GDAL reads, on disk or behind a URL")->required();
  app.add_flag("--json", json, "for programs");
  app.add_flag("--check", check,
               "look at structure too, decode every tile, and compare each level with what the one before gives");
  app.footer("example: nadir info --check kampala.tif");
  return app::run_command(app, argc, argv, [&]() -> Result<void> {
    const auto opened = tile::Map::open(path);
    const auto description = opened ? Result<tile::MapDescription>(opened->description()) : tile::describe(path);
    if (!description) return fail(description);
    app::Json told = app::to_json(*description, opened);
    if (!json) app::print_text(*description, opened);
    std::optional<pyramid::CheckReport> report;
    if (check) {
      auto checked = pyramid::check({.map = path, .show_progress = !json});
      if (!checked) return fail(checked);
      report = std::move(*checked);
      told["check"] = app::check_to_json(*report);
      if (!json) app::print_check(*report);
    }
    if (json) fmt::print("{}\n", told.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
    return report ? app::outcome(path, *report) : Result<void>();
  });
}
