#include "maps.h"

#include <fmt/format.h>
#include <gdal.h>
#include <gdal_utils.h>

#include <cmath>
#include <memory>
#include <vector>

#include "must.h"
#include "nadir/pyramid/build.h"

namespace nadir::bench {
namespace {

struct CloseDataset {
  void operator()(GDALDatasetH dataset) const noexcept { GDALClose(dataset); }
};
using Dataset = std::unique_ptr<void, CloseDataset>;

Dataset opened(const std::string& path) {
  GDALAllRegister();
  Dataset dataset{GDALOpenEx(path.c_str(), GDAL_OF_RASTER, nullptr, nullptr, nullptr)};
  return must(dataset ? Result<Dataset>(std::move(dataset))
                      : fail(Error::Kind::NotFound, path + ": expected a raster"));
}

/// Arguments as GDAL's programs take them.
struct Arguments {
  std::vector<std::string> words;
  std::vector<char*> list() {
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    return pointers;
  }
};

void written(Dataset dataset, const std::filesystem::path& path) {
  must(dataset ? Result<void>() : fail(Error::Kind::Io, path.string() + ": GDAL could not write it"));
}

/// As gdal_translate.
void translate(const Dataset& source, std::vector<std::string> words, const std::filesystem::path& path) {
  Arguments arguments{std::move(words)};
  const std::unique_ptr<GDALTranslateOptions, decltype(&GDALTranslateOptionsFree)> options{
      GDALTranslateOptionsNew(arguments.list().data(), nullptr), GDALTranslateOptionsFree};
  written(Dataset{GDALTranslate(path.c_str(), source.get(), options.get(), nullptr)}, path);
}

std::string naip() { return NADIR_SOURCE_DIR "/sim/demo/maps/naip_2014.tif"; }

/// Mercator metres of the paper's place; EPSG:3857 takes the Earth for a sphere.
Eigen::Vector2d paper_middle_m() {
  constexpr double radius_m = 6378137;
  return {radius_m * paper_lon.radians(), radius_m * std::asinh(std::tan(paper_lat.radians()))};
}

/// -a_ullr of a raster of that size around the paper's place.
std::vector<std::string> paper_corners(int width, int height) {
  const Eigen::Vector2d middle = paper_middle_m(), half = Eigen::Vector2d(width, height) * (paper_texel_m / 2);
  std::vector<std::string> words = {"-a_srs", "EPSG:3857", "-a_ullr"};
  for (const double value :
       {middle.x() - half.x(), middle.y() + half.y(), middle.x() + half.x(), middle.y() - half.y()})
    words.push_back(fmt::format("{:.9f}", value));
  return words;
}

void build(const std::string& source, const std::filesystem::path& path) {
  pyramid::BuildOptions options;
  options.sources = {source};
  options.output = path;
  options.force = true;
  options.role = tile::Role::Optical;
  options.show_progress = false;
  must(pyramid::build(options));
}

}  // namespace

tile::Map shipped_map(const std::string& name) {
  return must(tile::Map::open(NADIR_SOURCE_DIR "/sim/demo/maps/" + name));
}

tile::Map kampala_without_loss(const std::filesystem::path& folder) {
  const auto colours = folder / "kampala_colours.tif", path = folder / "kampala.tif";
  translate(opened(NADIR_SOURCE_DIR "/sim/demo/maps/kampala.tif"), {"-b", "1", "-b", "2", "-b", "3"}, colours);
  build(colours, path);
  return must(tile::Map::open(path));
}

tile::Map map_with_marks(const std::filesystem::path& folder) {
  constexpr int side = 1024, mark_side = 32, bands = 3;
  std::vector<std::uint8_t> texels(std::size_t{side} * side, 0);
  for (const auto& [x, y] : {std::pair{1, 0}, {0, 1}, {-1, 0}, {0, -1}})
    for (int row = 0; row < mark_side; ++row)
      for (int col = 0; col < mark_side; ++col)
        texels[static_cast<std::size_t>((side / 2 + y * mark_texels - mark_side / 2 + row) * side +  //
                                        side / 2 + x * mark_texels - mark_side / 2 + col)] = 255;

  GDALAllRegister();
  Dataset memory{GDALCreate(GDALGetDriverByName("MEM"), "", side, side, bands, GDT_Byte, nullptr)};
  for (int band = 1; band <= bands; ++band)
    must(GDALRasterIO(GDALGetRasterBand(memory.get(), band), GF_Write, 0, 0, side, side, texels.data(), side, side,
                      GDT_Byte, 0, 0) == CE_None
             ? Result<void>()
             : fail(Error::Kind::Io, "GDAL could not draw the map with marks"));
  const auto path = folder / "marks.tif";
  translate(memory, paper_corners(side, side), path);
  return must(tile::Map::open(path));
}

tile::Map naip_in_mercator(const std::filesystem::path& folder) {
  const auto path = folder / "naip_mercator.tif";
  Dataset source = opened(naip());
  Arguments arguments{{"-t_srs", "EPSG:3857", "-r", "bilinear"}};
  const std::unique_ptr<GDALWarpAppOptions, decltype(&GDALWarpAppOptionsFree)> options{
      GDALWarpAppOptionsNew(arguments.list().data(), nullptr), GDALWarpAppOptionsFree};
  GDALDatasetH sources[] = {source.get()};
  written(Dataset{GDALWarp(path.c_str(), nullptr, 1, sources, options.get(), nullptr)}, path);
  return must(tile::Map::open(path));
}

std::filesystem::path paper_sized_map(const std::filesystem::path& folder) {
  const auto enlarged = folder / "enlarged.tif", path = folder / "paper_sized.tif";
  std::vector<std::string> words = {"-b",
                                    "1",
                                    "-b",
                                    "2",
                                    "-b",
                                    "3",
                                    "-r",
                                    "bilinear",
                                    "-co",
                                    "TILED=YES",
                                    "-a_nodata",
                                    "none",
                                    "-outsize",
                                    std::to_string(paper_width),
                                    std::to_string(paper_height)};
  for (std::string& word : paper_corners(paper_width, paper_height)) words.push_back(std::move(word));
  translate(opened(naip()), std::move(words), enlarged);
  build(enlarged, path);
  return path;
}

}  // namespace nadir::bench
