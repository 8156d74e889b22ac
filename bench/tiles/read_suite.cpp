#include "read_suite.h"

#include <cpl_conv.h>
#include <cpl_vsi.h>
#include <fmt/format.h>
#include <gdal_priv.h>
#include <signal.h>
#include <sys/wait.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include "library_alone.h"
#include "nadir/bench/procedural_tiff.h"
#include "nadir/tile/cell_cache.h"
#include "nadir/transfer/options.h"
#include "web_server.h"

namespace nadir::bench {
namespace {

namespace fs = std::filesystem;
using tile::CellBlock, tile::CellCache, tile::CellRequest, tile::CellSource, tile::Map;

constexpr int tile_side = 512;
constexpr std::int64_t rgb_bytes = 3;

/// The map of the suite: RGB in tiles of 512, of the rule's content.
MapRule rule(std::int64_t side, Codec codec = Codec::none) {
  MapRule r;
  r.width = r.height = side;
  r.tile_size = tile_side;
  r.codec = codec;
  // All of the Earth in Web Mercator, whatever the size
  constexpr double half_m = 20037508;
  r.epsg = 3857;
  r.west = -half_m;
  r.north = half_m;
  r.texel = 2 * half_m / static_cast<double>(side);
  return r;
}

/// Makes it once a run: `name`.tif in the scratch folder, packed by GDAL with `options`.
Result<std::string> map_file(const RunOptions& options, std::int64_t side, const std::string& name,
                             const std::vector<std::string>& packing) {
  const fs::path plain = fs::path(options.scratch) / fmt::format("plain_{}.tif", side);
  if (!fs::exists(plain))
    if (auto ok = write_map(plain, rule(side)); !ok) return fail(ok);
  if (packing.empty()) return plain.string();
  const fs::path packed = fs::path(options.scratch) / fmt::format("{}_{}.tif", name, side);
  if (fs::exists(packed)) return packed.string();
  GDALAllRegister();
  const std::unique_ptr<GDALDataset> from(GDALDataset::Open(plain.c_str()));
  std::vector<std::string> words = {"TILED=YES", "BLOCKXSIZE=512", "BLOCKYSIZE=512", "PHOTOMETRIC=RGB"};
  words.insert(words.end(), packing.begin(), packing.end());
  std::vector<char*> list;
  for (std::string& word : words) list.push_back(word.data());
  list.push_back(nullptr);
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
  const std::unique_ptr<GDALDataset> to(
      from ? driver->CreateCopy(packed.c_str(), from.get(), false, list.data(), nullptr, nullptr) : nullptr);
  if (!to)
    return fail(Error::Kind::Io, fmt::format("{}: GDAL cannot make it: {}", packed.string(), CPLGetLastErrorMsg()));
  return packed.string();
}

Result<std::shared_ptr<const CellSource>> source_of(const std::string& path) {
  const auto map = Map::open(path);
  if (!map) return fail(map);
  return CellSource::make(*map, {}, tile::Domain::Linear);
}

/// Runs `one(i)` for i in [0, n) on so many threads; the first error in order.
Result<void> side_by_side(int threads, std::size_t n, const std::function<Result<void>(std::size_t)>& one) {
  std::vector<Result<void>> done(n);
  if (threads == 1) {
    for (std::size_t i = 0; i < n; ++i) done[i] = one(i);
  } else {
    static tbb::task_arena arena(threads);  // of this case: each has a process of its own
    arena.execute([&] { tbb::parallel_for(std::size_t{0}, n, [&](std::size_t i) { done[i] = one(i); }); });
  }
  for (const auto& d : done)
    if (!d) return d;
  return {};
}

/// All tiles of a map, from the page cache into cells, beside the codec's library unpacking the same bytes in memory.
Case tile_load(const RunOptions& options, const std::string& codec, const std::vector<std::string>& packing,
               int threads) {
  return {
      fmt::format("tile load, {}, {} thread{}", codec, threads, threads == 1 ? "" : "s"), [=]() -> Result<Comparison> {
        const std::int64_t side = options.quick ? 1024 : 4096;
        const auto path = map_file(options, side, codec, packing);
        if (!path) return fail(path);
        const auto source = source_of(*path);
        if (!source) return fail(source);
        auto opened = LibraryAlone::open(*path);
        if (!opened) return fail(opened);
        const std::shared_ptr<LibraryAlone> library(std::move(*opened));
        const auto across = static_cast<std::size_t>(side / tile_side);
        const auto ours = [=]() -> Result<void> {
          return side_by_side(threads, library->tiles(), [&](std::size_t i) -> Result<void> {
            const auto col = static_cast<std::int32_t>(i % across), row = static_cast<std::int32_t>(i / across);
            constexpr int cells = tile_side / tile::cell_size;
            const auto loaded = (*source)->load((*source)->block_of(0, col * cells, row * cells));
            return loaded ? Result<void>{} : fail(loaded);
          });
        };
        const auto alone = [=]() -> Result<void> {
          return side_by_side(threads, library->tiles(), [&](std::size_t i) {
            thread_local std::vector<std::byte> out;
            out.resize(library->tile_bytes());
            return library->unpack(i, out.data());
          });
        };
        const bool plain = packing.empty();
        Comparison comparison;
        comparison.methods = {{.name = "nadir", .run = ours}, {.name = plain ? "plain copy" : "library", .run = alone}};
        comparison.work = static_cast<double>(side * side * rgb_bytes) / 1e6;
        comparison.work_unit = "MB";
        comparison.aims = {{"nadir", comparison.methods[1].name, plain ? 1 / 0.5 : 1 / 0.85}};
        return comparison;
      }};
}

/// Cells of 256 tiles that are all there, asked for at random.
Case warm_lookup(const RunOptions& options) {
  return {"warm lookup, 256 tiles", [=]() -> Result<Comparison> {
            const auto path = map_file(options, 8192, "none", {});
            if (!path) return fail(path);
            const auto source = source_of(*path);
            if (!source) return fail(source);
            const auto cache = std::make_shared<CellCache>(1ull << 30);
            std::vector<CellRequest> all;
            for (int i = 0; i < 64 * 64; ++i) all.push_back({source->get(), 0, i % 64, i / 64});
            if (auto held = cache->pin(all); !held) return fail(held);
            constexpr int lookups = 200'000;
            const auto look = [=](int threads) {
              return [=]() -> Result<void> {
                std::vector<std::thread> workers;
                std::atomic<int> missed{0};
                for (int t = 0; t < threads; ++t)
                  workers.emplace_back([&, t] {
                    std::minstd_rand random(static_cast<unsigned>(t + 1));
                    for (int i = 0; i < lookups; ++i) {
                      const auto cell = static_cast<std::int32_t>(random() >> 4) & 4095;
                      missed += !cache->get(**source, 0, cell % 64, cell / 64);
                    }
                  });
                for (auto& worker : workers) worker.join();
                return missed == 0 ? Result<void>{} : fail(Error::Kind::Io, "a cell was not there");
              };
            };
            Comparison comparison;
            comparison.methods = {{.name = "lookups", .setting = "threads=1", .run = look(1)},
                                  {.name = "lookups", .setting = "threads=2, each as many", .run = look(2)}};
            comparison.work = lookups / 1e6;
            comparison.work_unit = "million lookups a thread";
            comparison.aims = {{"lookups, threads=2, each as many", "lookups, threads=1", 1.2}};
            return comparison;
          }};
}

/// A view of 1920 x 1080 texels that no tile's border meets.
constexpr int view_x = 1100, view_y = 700, view_width = 1920, view_height = 1080;

std::vector<CellRequest> view(const CellSource& source, int level = 0) {
  std::vector<CellRequest> cells;
  const auto last = [](int first, int size) { return (first + size - 1) / tile::cell_size; };
  for (int row = view_y / tile::cell_size; row <= last(view_y, view_height); ++row)
    for (int col = view_x / tile::cell_size; col <= last(view_x, view_width); ++col)
      cells.push_back({&source, level, col, row});
  return cells;
}

Result<void> open_and_pin(const Result<Map>& map, int threads) {
  if (!map) return fail(map);
  const auto source = CellSource::make(*map, {}, tile::Domain::Linear);
  if (!source) return fail(source);
  CellCache cache(256 << 20, threads);
  const auto cells = cache.pin(view(**source));
  return cells ? Result<void>{} : fail(cells);
}

/// As a careful user of GDAL reads it: a fresh dataset, one RasterIO of the window, all bands interleaved.
Result<void> open_and_read_by_gdal(const std::string& path, int threads) {
  CPLSetThreadLocalConfigOption("GDAL_NUM_THREADS", std::to_string(threads).c_str());
  const std::unique_ptr<GDALDataset> dataset(GDALDataset::Open(path.c_str()));
  static std::vector<std::uint8_t> out(static_cast<std::size_t>(view_width) * view_height * 3);
  if (!dataset || dataset->RasterIO(GF_Read, view_x, view_y, view_width, view_height, out.data(), view_width,
                                    view_height, GDT_Byte, 3, nullptr, 3, 3 * view_width, 1, nullptr) != CE_None)
    return fail(Error::Kind::Io, fmt::format("{}: GDAL: {}", path, CPLGetLastErrorMsg()));
  return {};
}

Case open_and_first_view(const RunOptions& options, const std::string& codec, const std::vector<std::string>& packing) {
  return {"open and first 1080p view, " + codec, [=]() -> Result<Comparison> {
            const auto path = map_file(options, 8192, codec, packing);
            if (!path) return fail(path);
            GDALAllRegister();
            Comparison comparison;
            for (const int threads : {1, 2}) {
              const std::string setting = fmt::format("threads={}", threads);
              comparison.methods.push_back({.name = "nadir", .setting = setting, .run = [=] {
                                              return open_and_pin(Map::open(*path), threads);
                                            }});
              comparison.methods.push_back(
                  {.name = "GDAL", .setting = setting, .run = [=] { return open_and_read_by_gdal(*path, threads); }});
            }
            comparison.aims = {{"nadir, threads=1", "GDAL, threads=1", 1 / 2.5},
                               {"nadir, threads=2", "GDAL, threads=2", 1 / 2.5}};
            return comparison;
          }};
}

/// `nadir info`, and the same program with GDAL's libraries linked before it starts.
Case process_start(const RunOptions& options) {
  return {"process start of nadir info on a COG", [=]() -> Result<Comparison> {
            const auto path = map_file(options, 1024, "none", {});
            if (!path) return fail(path);
            const fs::path here = fs::read_symlink("/proc/self/exe").parent_path();
            const std::string info = (here / "nadir-info").string(), module = (here / "nadir_gdal.so").string();
            Comparison comparison;
            comparison.methods = {
                {.name = "nadir info", .command = {"env", info, *path}},
                {.name = "GDAL linked at start", .command = {"env", "LD_PRELOAD=" + module, info, *path}}};
            comparison.aims = {{"nadir info", "GDAL linked at start", 1 / 2.0}};
            return comparison;
          }};
}

/// Maps that exist nowhere, of 4096 to 2^30 texels a side: the same work.
Case growth(const RunOptions&) {
  return {"open and first 1080p view by size of the map", []() -> Result<Comparison> {
            Comparison comparison;
            for (const std::int64_t side : {std::int64_t{4096}, std::int64_t{131072}, std::int64_t{1} << 30}) {
              auto map = ProceduralTiff::make(fmt::format("rule_{}", side), rule(side));
              if (!map) return fail(map);
              const std::shared_ptr<const ByteSource> bytes = *map;
              comparison.methods.push_back({.name = fmt::format("{} texels a side", side),
                                            .run = [=] { return open_and_pin(Map::open(bytes), 1); }});
            }
            comparison.aims = {{comparison.methods[1].name, comparison.methods[0].name, 1.1},
                               {comparison.methods[2].name, comparison.methods[0].name, 1.1}};
            return comparison;
          }};
}

/// The memory that opening and one view take, each in a process of its own.
Case growth_of_memory(const RunOptions&) {
  return {
      "memory for open and first 1080p view by size of the map", []() -> Result<Comparison> {
        Comparison comparison;
        for (const std::int64_t side : {std::int64_t{4096}, std::int64_t{131072}, std::int64_t{1} << 30}) {
          const auto run = [side]() -> Result<void> {
            auto map = ProceduralTiff::make(fmt::format("rule_{}", side), rule(side));
            if (!map) return fail(map);
            const auto opened = Map::open(std::shared_ptr<const ByteSource>(*map));
            if (!opened) return fail(opened);
            const auto source = CellSource::make(*opened, {}, tile::Domain::Linear);
            if (!source) return fail(source);
            CellCache cache(256 << 20, 1);
            for (const CellRequest& cell : view(**source))  // one after another: a forked child has no pool of threads
              if (auto got = cache.get(*cell.source, cell.level, cell.col, cell.row); !got) return fail(got);
            return {};
          };
          comparison.methods.push_back({.name = fmt::format("{} texels a side", side), .run = run, .peak = true});
        }
        return comparison;
      }};
}

/// A map behind nginx and 20 ms: fresh caches, open and one view.
Case far_away(const RunOptions& options, const std::string& codec, const std::vector<std::string>& packing) {
  return {fmt::format("{} from nginx, 20 ms away", codec), [=]() -> Result<Comparison> {
            const auto path = map_file(options, 4096, codec, packing);
            if (!path) return fail(path);
            auto started = WebServer::start(options.scratch, 20);
            if (!started) return fail(started);
            const std::shared_ptr<WebServer> server(std::move(*started));
            const std::string url = server->url(fs::path(*path).filename().string());
            // GDAL as its users tune it for maps in the cloud
            for (const auto& [key, value] : std::initializer_list<std::pair<const char*, const char*>>{
                     {"GDAL_DISABLE_READDIR_ON_OPEN", "EMPTY_DIR"},
                     {"CPL_VSIL_CURL_ALLOWED_EXTENSIONS", ".tif"},
                     {"VSI_CACHE", "TRUE"},
                     {"GDAL_INGESTED_BYTES_AT_OPEN", "32768"},
                     {"GDAL_HTTP_MERGE_CONSECUTIVE_RANGES", "YES"},
                     {"GDAL_HTTP_MULTIRANGE", "YES"},
                     {"GDAL_HTTP_MULTIPLEX", "YES"},
                     {"GDAL_HTTP_VERSION", "2"}})
              CPLSetConfigOption(key, value);
            GDALAllRegister();
            const fs::path cache = fs::path(options.scratch) / "transfer_cache";
            ::setenv("XDG_CACHE_HOME", cache.c_str(), 1);
            // Closed after the clock has stopped: what was read is written to the cache behind the reader's back
            const auto kept = std::make_shared<Result<Map>>(fail(Error::Kind::NotFound, "not open yet"));
            const auto ours = std::make_shared<std::int64_t>(0), theirs = std::make_shared<std::int64_t>(0);
            const auto counted = [](const std::shared_ptr<std::int64_t>& requests) {
              return [requests]() -> std::map<std::string, std::string> {
                return {{"requests", std::to_string(*requests)}};
              };
            };
            const auto begin = [=]() -> Result<void> {
              fs::remove_all(cache);
              VSICurlClearCache();
              server->forget_requests();
              return {};
            };
            Comparison comparison;
            comparison.methods = {{.name = "nadir",
                                   .run = [=] { return open_and_pin(*kept = Map::open(url), 2); },
                                   .before = begin,
                                   .after = [=]() -> Result<void> {
                                     *ours = server->requests();
                                     *kept = fail(Error::Kind::NotFound, "closed");
                                     return {};
                                   },
                                   .counters = counted(ours)},
                                  {.name = "GDAL /vsicurl, tuned",
                                   .run = [=] { return open_and_read_by_gdal("/vsicurl/" + url, 2); },
                                   .before = begin,
                                   .after = [=]() -> Result<void> {
                                     *theirs = server->requests();
                                     return {};
                                   },
                                   .counters = counted(theirs)}};
            comparison.aims = {{"nadir", "GDAL /vsicurl, tuned", 1 / 1.5}};
            return comparison;
          }};
}

}  // namespace

Suite read_suite() {
  return {"read", "tiles from disk or network to the sampler's cells", [](const RunOptions& options) {
            const std::vector<std::pair<std::string, std::vector<std::string>>> codecs = {
                {"none", {}},
                {"deflate", {"COMPRESS=DEFLATE"}},
                {"deflate_predictor", {"COMPRESS=DEFLATE", "PREDICTOR=2"}},
                {"zstd", {"COMPRESS=ZSTD"}},
                {"zstd_predictor", {"COMPRESS=ZSTD", "PREDICTOR=2"}},
                {"lzw", {"COMPRESS=LZW"}},
                {"jpeg", {"COMPRESS=JPEG", "PHOTOMETRIC=YCBCR", "JPEG_QUALITY=90"}},
                {"webp", {"COMPRESS=WEBP"}},
                {"lerc", {"COMPRESS=LERC"}},
                {"lzma", {"COMPRESS=LZMA"}}};
            std::vector<Case> cases;
            for (const auto& [name, packing] : codecs)
              for (const int threads : {1, 2}) cases.push_back(tile_load(options, name, packing, threads));
            cases.push_back(warm_lookup(options));
            for (const std::size_t i : {std::size_t{0}, std::size_t{3}})
              cases.push_back(open_and_first_view(options, codecs[i].first, codecs[i].second));
            cases.push_back(process_start(options));
            cases.push_back(growth(options));
            cases.push_back(growth_of_memory(options));
            for (const std::size_t i : {std::size_t{0}, std::size_t{3}})
              cases.push_back(far_away(options, codecs[i].first, codecs[i].second));
            return cases;
          }};
}

}  // namespace nadir::bench
