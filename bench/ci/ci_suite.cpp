#include "ci_suite.h"

#include <fmt/format.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>

#include "allocations.h"
#include "nadir/base/byte_source.h"
#include "nadir/base/files.h"
#include "nadir/base/text.h"
#include "nadir/bench/procedural_tiff.h"
#include "nadir/render/renderer.h"
#include "peer_cases.h"
#include "work_counts.h"

namespace nadir::bench {
namespace {

using namespace render;
namespace fs = std::filesystem;

const fs::path maps = NADIR_SOURCE_DIR "/sim/demo/maps";

/// Counts what is read of it.
class CountedFile : public ByteSource {
 public:
  explicit CountedFile(std::shared_ptr<const ByteSource> file) : file_(std::move(file)) {}
  const std::string& name() const override { return file_->name(); }
  std::uint64_t size() const override { return file_->size(); }
  Result<void> read(std::uint64_t offset, std::span<std::byte> out) const override {
    bytes_ += out.size();
    return file_->read(offset, out);
  }
  std::int64_t bytes() const { return static_cast<std::int64_t>(bytes_); }

 private:
  std::shared_ptr<const ByteSource> file_;
  mutable std::atomic<std::uint64_t> bytes_{0};
};

/// A view of a map, and what else is in the scene.
struct View {
  std::string name, file;  // of the maps that ship with the project; where empty, one of 2^30 texels a side by rule
  LayerOptions layer;
  bool ellipsoid = false, twice = false;  // the layer
  double height_m = 74.4, yaw_deg = 33, pitch_deg = 8, roll_deg = -6;
  std::vector<double> barrel;  // a plumb_bob lens
};

std::vector<View> views() {
  const LayerOptions rgb{.bands = {1, 2, 3}};
  const LayerOptions radar{.role = tile::Role::Radar, .bands = {1}};
  return {{.name = "a texel a pixel", .file = "kampala.tif", .layer = rgb},
          {.name = "three texels a pixel", .file = "kampala.tif", .layer = rgb, .height_m = 223},
          {.name = "oblique", .file = "kampala.tif", .layer = rgb, .pitch_deg = 60},
          {.name = "magnified", .file = "kampala.tif", .layer = rgb, .height_m = 15},
          {.name = "over the horizon", .file = "kampala.tif", .layer = rgb, .pitch_deg = 85},
          {.name = "a lens", .file = "kampala.tif", .layer = rgb, .barrel = {-0.28, 0.07, 0.0008, -0.0005, 0}},
          {.name = "two layers", .file = "kampala.tif", .layer = rgb, .twice = true},
          {.name = "the ellipsoid in degrees",
           .file = "spain_s2.tif",
           .layer = {.bands = {4, 3, 2}},
           .ellipsoid = true,
           .height_m = 5000},
          {.name = "radar", .file = "spain_s1.tif", .layer = radar, .height_m = 3000},
          {.name = "2^30 texels a side", .layer = rgb, .height_m = 3000}};
}

constexpr int width = 640, height = 480;

struct Stage {
  Scene scene;
  Camera camera;
  CameraPose pose;
  std::shared_ptr<const CountedFile> file;
};

Result<Stage> stage_of(const View& view) {
  std::shared_ptr<const ByteSource> bytes;
  if (view.file.empty()) {
    auto made = ProceduralTiff::make("rule.tif", {.width = 1 << 30,
                                                  .height = 1 << 30,
                                                  .codec = Codec::none,
                                                  .west = 300'000,
                                                  .north = 6'000'000,
                                                  .texel = 1e-3,
                                                  .exact_byte_counts = false});
    if (!made) return fail(made);
    bytes = *made;
  } else {
    auto opened = LocalFile::open((maps / view.file).string());
    if (!opened) return fail(opened);
    bytes = *opened;
  }
  auto file = std::make_shared<const CountedFile>(std::move(bytes));
  const auto map = tile::Map::open(file);
  if (!map) return fail(map);
  Scene scene = view.ellipsoid ? Scene::ellipsoid(map->center(), 0) : Scene::plane(map->center(), {});
  scene = scene.with_layer("one", *map, view.layer);
  if (view.twice) scene = scene.with_layer("two", *map, view.layer);
  Camera camera = Camera::pinhole(width, height, 500, 500, width * 0.5, height * 0.5).value();
  if (!view.barrel.empty()) camera = camera.with_lens(Lens::make(LensModel::plumb_bob, view.barrel).value());
  geodesy::Geodetic place = map->center();
  place.height_m = view.height_m;
  return Stage{std::move(scene), std::move(camera),
               camera_pose(place, geodesy::YawPitchRoll::degrees(view.yaw_deg, view.pitch_deg, view.roll_deg)),
               std::move(file)};
}

/// Renders a view twice on one thread, the first time with nothing in memory.
Result<WorkCounts> count(const View& view, Quality quality) {
  const auto stage = stage_of(view);
  if (!stage) return fail(stage);
  Renderer renderer({.threads = 1});
  const RenderOptions options{.quality = quality};
  const std::int64_t opened = stage->file->bytes();
  const auto cold = renderer.render(stage->scene, stage->camera, stage->pose, options);
  if (!cold) return fail(cold);
  const tile::CacheCounters cache = renderer.cache_counters();
  const std::int64_t read = stage->file->bytes() - opened, before = allocations();
  const auto warm = renderer.render(stage->scene, stage->camera, stage->pose, options);
  if (!warm) return fail(warm);
  const std::int64_t allocated = allocations() - before;
  const FrameCounters& frame = warm->counters();
  return WorkCounts{{"exact points", frame.exact_points},
                    {"points through PROJ", frame.projection_points},
                    {"samples a thousand pixels", frame.samples * 1000 / (width * height)},
                    {"cells", frame.cells},
                    {"cells loaded", cold->counters().cells_loaded},
                    {"tiles decoded", cache.blocks_loaded},
                    {"bytes read", read},
                    {"bytes read to open", opened},
                    {"loads of the warm frame", frame.cells_loaded},
                    {"passes", frame.passes},
                    {"allocations of the warm frame", allocated}};
}

/// Compares, or where that was asked for accepts.
Result<void> judge(const std::string& case_name, const std::string& method, const WorkCounts& found, bool accept) {
  auto expected = ExpectedCounts::read(NADIR_SOURCE_DIR "/bench/ci/expected.csv");
  if (!expected) return fail(expected);
  if (accept) return expected->replace(case_name, method, found);
  const std::string differences = expected->differences(case_name, method, found);
  if (differences.empty()) return {};
  return fail(Error::Kind::Malformed,
              differences + "; where that is meant, `nadir bench ci --accept` makes it what is expected");
}

Method counted(const std::string& case_name, Quality quality, std::function<Result<WorkCounts>()> count, bool accept) {
  const auto found = std::make_shared<WorkCounts>();
  const std::string setting(to_string(quality));
  return {.name = "nadir",
          .setting = setting,
          .run = [=]() -> Result<void> {
            auto counts = count();
            if (!counts) return fail(counts);
            *found = std::move(*counts);
            return judge(case_name, setting, *found, accept);
          },
          .counters = [=]() -> std::map<std::string, std::string> {
            std::map<std::string, std::string> text;
            for (const auto& [name, number] : *found) text[name] = std::to_string(number);
            return text;
          }};
}

/// Instructions that the kernels take for a frame of 640 x 480 at a texel a pixel, counted by Valgrind, which knows no
/// AVX-512: of the AVX2 kernels.
Result<WorkCounts> count_instructions(Quality quality, const fs::path& scratch) {
  const auto program = fs::read_symlink("/proc/self/exe").parent_path() / "nadir-render";
  const fs::path camera = scratch / "camera.yaml", poses = scratch / "poses.csv", said = scratch / "said.txt";
  if (auto ok =
          write_file(camera, Camera::pinhole(width, height, 500, 500, width * 0.5, height * 0.5).value().to_yaml());
      !ok)
    return fail(ok);
  if (auto ok = write_file(poses,
                           "t_s,lat_deg,lon_deg,height_m,yaw_deg,pitch_deg,roll_deg\n"
                           "0,0.350874,32.594719,74.4,33,8,-6\n");
      !ok)
    return fail(ok);
  const std::string command = fmt::format(
      "valgrind --tool=callgrind --callgrind-out-file=/dev/null "
      "'--toggle-collect=nadir::render::sample_block(*unsigned long)' '{}' "
      "--map '{}' --bands 1,2,3 --camera '{}' --poses '{}' --quality {} --threads 1 --no-output >'{}' 2>&1",
      program.string(), (maps / "kampala.tif").string(), camera.string(), poses.string(), to_string(quality),
      said.string());
  const bool done = std::system(command.c_str()) == 0;
  std::ifstream in(said);
  const std::string output((std::istreambuf_iterator<char>(in)), {});
  const auto at = output.find("Collected : ");
  const auto instructions =
      at == std::string::npos ? std::nullopt : parse_number(output.substr(at + 12, output.find('\n', at) - at - 12));
  if (!done || !instructions || *instructions == 0)
    return fail(Error::Kind::Io, "valgrind counted no instructions; it said: " + output);
  return WorkCounts{{"instructions", static_cast<std::int64_t>(*instructions)}};
}

Case kernels(const RunOptions& options) {
  return {"instructions of the kernels", [=]() -> Result<Comparison> {
            Comparison comparison{.warm_up = false, .go_on = true, .rounds = 1};
            const bool there = std::system("valgrind --version >/dev/null 2>&1") == 0;
            for (const Quality quality : {Quality::draft, Quality::balanced, Quality::best}) {
              comparison.methods.push_back(counted(
                  "instructions of the kernels", quality,
                  [=, scratch = fs::path(options.scratch)] { return count_instructions(quality, scratch); },
                  options.accept));
              if (!there) comparison.methods.back().left_out = "valgrind is not installed";
            }
            return comparison;
          }};
}

Case one_view(const View& view, bool accept) {
  return {view.name, [=]() -> Result<Comparison> {
            Comparison comparison{.warm_up = false, .go_on = true, .rounds = 1};
            for (const Quality quality : {Quality::draft, Quality::balanced, Quality::best})
              comparison.methods.push_back(counted(
                  view.name, quality, [=] { return count(view, quality); }, accept));
            return comparison;
          }};
}

}  // namespace

Suite ci_suite() {
  return {"ci", "whether frames take the work that they took before: counts against expected ones",
          [](const RunOptions& options) {
            std::vector<Case> cases;
            for (const View& view : views()) cases.push_back(one_view(view, options.accept));
            cases.push_back(kernels(options));
            for (Case& one : peer_cases(options)) cases.push_back(std::move(one));
            return cases;
          }};
}

}  // namespace nadir::bench
