// nadir verify: is a dataset what its run file makes? Recomputes truth, renders random frames again, compares
// checksums.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <sstream>

#include "command.h"
#include "nadir/base/files.h"
#include "nadir/base/text.h"
#include "nadir/record/frame_record.h"
#include "nadir/record/image_files.h"
#include "nadir/record/truth_plane_file.h"
#include "nadir/sim/run.h"

namespace nadir::app {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

/// A frame's place in a dataset.
struct FrameKey {
  std::string vehicle, sensor;
  std::int64_t time_ns = 0;
  friend auto operator<=>(const FrameKey&, const FrameKey&) = default;
  std::string text() const { return fmt::format("{}/{} at {} ns", vehicle, sensor, time_ns); }
};

Result<std::map<FrameKey, Json>> read_records(const fs::path& path) {
  constexpr std::size_t limit_bytes = std::size_t{4} << 30;
  const auto text = read_text_file(path, limit_bytes);
  if (!text) return fail(text);
  std::map<FrameKey, Json> records;
  std::istringstream lines(*text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const Json json = Json::parse(line, nullptr, /*allow_exceptions=*/false);
    const bool usable = json.is_object() && json.value("vehicle", Json()).is_string() &&
                        json.value("sensor", Json()).is_string() && json.value("time_ns", Json()).is_number_integer();
    if (!usable)
      return fail(Error::Kind::Malformed, fmt::format("{}:{}: expected a frame's record", path.string(), number));
    records[{json["vehicle"], json["sensor"], json["time_ns"]}] = json;
  }
  return records;
}

/// Where footprints.geojson does not say what the records do.
Result<std::vector<std::string>> compare_footprints(const fs::path& path, const std::map<FrameKey, Json>& records) {
  constexpr std::size_t limit_bytes = std::size_t{4} << 30;
  const auto text = read_text_file(path, limit_bytes);
  if (!text) return fail(text);
  const Json json = Json::parse(*text, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object() || !json.value("features", Json()).is_array())
    return fail(Error::Kind::Malformed, path.string() + ": expected a GeoJSON FeatureCollection");
  std::map<FrameKey, const Json*> features;
  for (const Json& feature : json["features"]) {
    const Json properties = feature.is_object() ? feature.value("properties", Json()) : Json();
    if (!properties.is_object() || !properties.value("vehicle", Json()).is_string() ||
        !properties.value("sensor", Json()).is_string() || !properties.value("time_ns", Json()).is_number_integer())
      return fail(Error::Kind::Malformed, path.string() + ": expected Features of frames");
    features[{properties["vehicle"], properties["sensor"], properties["time_ns"]}] = &feature;
  }
  std::vector<std::string> complaints;
  for (const auto& [key, record] : records) {
    if (!record.contains("checksum")) continue;  // it was rejected
    const auto found = features.find(key);
    if (found == features.end()) {
      complaints.push_back(fmt::format("{}: footprints.geojson lacks it", key.text()));
      continue;
    }
    const Json& feature = *found->second;
    const Json footprint = record.value("footprint", Json::object());
    if (feature.value("geometry", Json()) != footprint.value("geometry", Json()) ||
        feature["properties"].value("file", Json()) != record["file"])
      complaints.push_back(fmt::format("{}: footprints.geojson has another footprint", key.text()));
    features.erase(found);
  }
  for (const auto& [key, feature] : features)
    complaints.push_back(fmt::format("{}: footprints.geojson has this frame, and frames.jsonl does not", key.text()));
  return complaints;
}

/// Whether a frame did not wait for all of its map tiles: another run need not make the same.
bool is_coarse(const Json& record) {
  const Json coarse = record.value("settings", Json::object()).value("coarse", Json());
  return coarse.is_object() && coarse.value("fraction", 0.0) > 0;
}

/// Which frames are rendered again: `count` of them, of those that can be, chosen by the seed alone.
std::vector<FrameKey> choose(const std::map<FrameKey, Json>& records, std::size_t count, std::uint64_t seed) {
  std::vector<FrameKey> keys;
  for (const auto& [key, json] : records)
    if (json.contains("checksum") && !is_coarse(json)) keys.push_back(key);
  std::mt19937_64 random(seed);
  for (std::size_t i = 0; i < std::min(count, keys.size()); ++i)
    std::swap(keys[i], keys[i + random() % (keys.size() - i)]);
  keys.resize(std::min(count, keys.size()));
  std::sort(keys.begin(), keys.end());
  return keys;
}

/// Flies the run again and compares.
class Verifier final : public sim::Sink {
 public:
  Verifier(const sim::Run& run, const fs::path& folder, std::map<FrameKey, Json> records, std::vector<FrameKey> chosen,
           render::Renderer& renderer)
      : run_(run), folder_(folder), records_(std::move(records)), chosen_(std::move(chosen)), renderer_(renderer) {}

  Result<void> on_frame(const sim::FrameEvent& event) override {
    const FrameKey key{event.vehicle, event.sensor, event.state.time_ns};
    const auto found = records_.find(key);
    if (found == records_.end())
      return complain(fmt::format("{}: the run makes this frame, and the dataset has no record of it", key.text()));
    const Json record = std::move(found->second);
    records_.erase(found);
    if (!record.contains("checksum")) return {};  // it was rejected
    ++truths;
    compare_truth(key, record, event.truth);
    if (!fs::is_regular_file(folder_ / record["file"].get<std::string>()))
      complain(fmt::format("{}: its file {} is missing", key.text(), record["file"].get<std::string>()));
    const auto planes = planes_file(key, record);
    if (!std::binary_search(chosen_.begin(), chosen_.end(), key)) return {};
    if (planes) compare_planes(key, *planes, event);
    return compare_pixels(key, record, event);
  }

  Result<void> finish() override {
    for (const auto& [key, record] : records_)
      complain(fmt::format("{}: the dataset has this frame, and the run does not make it", key.text()));
    return {};
  }

  std::int64_t truths = 0, rendered = 0, planes_compared = 0;
  std::vector<std::string> complaints;

 private:
  Result<void> complain(std::string text) {
    complaints.push_back(std::move(text));
    return {};
  }

  /// All of the record that geometry alone decides, to the last digit.
  void compare_truth(const FrameKey& key, const Json& record, const render::Truth& truth) {
    render::FrameLayer layer;
    layer.truth = truth;
    const Json again = Json::parse(record::frame_record({}, layer));
    for (const char* field : {"pose", "camera_matrix", "map_pixel_from_image_pixel", "image_pixel_from_map_pixel",
                              "homography_max_error_px", "footprint", "image_gsd_m", "magnification"})
      if (!record.contains(field) || record[field] != again[field])
        complain(fmt::format("{}: its {} is not what the run gives", key.text(), field));
  }

  /// The file of a frame's truth planes, where it has one.
  std::optional<fs::path> planes_file(const FrameKey& key, const Json& record) {
    const Json named = record.value("truth_planes", Json());
    if (named.is_string() != run_.file().record_truth_planes)
      complain(fmt::format("{}: it {} truth planes, and the run file asks for {}", key.text(),
                           named.is_string() ? "has" : "has no", named.is_string() ? "none" : "them"));
    if (!named.is_string()) return {};
    const fs::path file = folder_ / named.get<std::string>();
    if (fs::is_regular_file(file)) return file;
    complain(fmt::format("{}: its file {} is missing", key.text(), named.get<std::string>()));
    return {};
  }

  /// Every pixel of every plane, to the last bit.
  void compare_planes(const FrameKey& key, const fs::path& file, const sim::FrameEvent& event) {
    const auto found = record::read_truth_planes(file);
    if (!found) {
      complain(fmt::format("{}: {}", key.text(), found.error().message));
      return;
    }
    const render::TruthPlanes again =
        render::truth_planes(sim::exact_chain(event.state, run_.sensor(event.vehicle, event.sensor)));
    ++planes_compared;
    if (*found != again) complain(fmt::format("{}: its truth planes are not what the run gives", key.text()));
  }

  /// The run's; the way of sampling of an adaptive sensor is what the frame's record says.
  Result<render::RenderOptions> options_of(const Json& record, const sim::PreparedSensor& sensor) const {
    render::RenderOptions options = run_.render_options(sensor);
    const Json settings = record.value("settings", Json::object());
    const Json adaptive = settings.value("adaptive", Json(false));
    if (adaptive != Json(sensor.setup.adaptive))
      return fail(Error::Kind::Malformed,
                  fmt::format("its record does not say that it is {}adaptive, as the run file does",
                              sensor.setup.adaptive ? "" : "not "));
    if (!sensor.setup.adaptive) return options;
    const Json quality = settings.value("quality", Json()), oversampling = settings.value("oversampling", Json());
    if (!quality.is_string() || !oversampling.is_number())
      return fail(Error::Kind::Malformed, "its settings lack a quality and an oversampling");
    const auto parsed = render::parse_quality(quality.get<std::string>());
    if (!parsed) return fail(parsed);
    options.quality = *parsed;
    options.oversampling = oversampling.get<double>();
    return options;
  }

  Result<void> compare_pixels(const FrameKey& key, const Json& record, const sim::FrameEvent& event) {
    const sim::PreparedSensor& sensor = run_.sensor(event.vehicle, event.sensor);
    auto options = options_of(record, sensor);
    if (!options) return complain(fmt::format("{}: {}", key.text(), options.error().message));
    options->allow_coarse = false;
    const auto frame = sim::render_frame(renderer_, event.state, sensor, *options);
    if (!frame) return fail(frame);
    ++rendered;
    if (record::checksum(frame->layer()) != record["checksum"])
      return complain(fmt::format("{}: rendered again, its checksum differs", key.text()));
    const auto images = record::image_files();
    if (!images) return fail(images);
    const auto image = (*images)->read(folder_ / record["file"].get<std::string>());
    if (!image) return complain(fmt::format("{}: {}", key.text(), image.error().message));
    const auto& samples = frame->layer().samples;
    // As bytes: NaN marks invalid pixels of floats, and is equal to nothing
    if (image->samples != samples)
      return complain(fmt::format("{}: the image file holds other pixels than were rendered", key.text()));
    return {};
  }

  const sim::Run& run_;
  const fs::path folder_;
  std::map<FrameKey, Json> records_;
  const std::vector<FrameKey> chosen_;
  render::Renderer& renderer_;
};

Result<void> run(const fs::path& folder, std::size_t frames, std::uint64_t seed, bool json) {
  const auto file = sim::read_run_file(folder / "run.yaml");
  if (!file)
    return fail(file.error().kind,
                file.error().message +
                    (file.error().kind == Error::Kind::NotFound ? "; verify needs a dataset of nadir fly" : ""));
  auto run = sim::Run::prepare(*file);
  if (!run) return fail(run);
  auto records = read_records(folder / "frames.jsonl");
  if (!records) return fail(records);
  auto footprints = compare_footprints(folder / "footprints.geojson", *records);
  if (!footprints) return fail(footprints);
  const std::size_t total = records->size();
  const auto coarse =
      std::count_if(records->begin(), records->end(), [](const auto& entry) { return is_coarse(entry.second); });
  const auto chosen = choose(*records, frames, seed);
  render::Renderer renderer;
  Verifier verifier(*run, folder, std::move(*records), chosen, renderer);
  verifier.complaints = std::move(*footprints);
  sim::Sink* const sinks[] = {&verifier};
  if (const auto flown = run->execute(renderer, sinks, /*render_frames=*/false, /*pace=*/0); !flown) return fail(flown);

  if (json) {
    fmt::print("{}\n", nlohmann::ordered_json{{"records", total},
                                              {"truths_compared", verifier.truths},
                                              {"frames_rendered", verifier.rendered},
                                              {"frames_coarse", coarse},
                                              {"truth_planes_compared", verifier.planes_compared},
                                              {"complaints", verifier.complaints}}
                           .dump(2));
  } else {
    constexpr std::size_t most = 20;
    for (std::size_t i = 0; i < std::min(most, verifier.complaints.size()); ++i)
      fmt::print("{}\n", verifier.complaints[i]);
    if (coarse > 0)
      fmt::print("{} frames cannot be rendered again: they did not wait for their map tiles (allow_coarse)\n", coarse);
    if (verifier.complaints.size() > most) fmt::print("... and {} more\n", verifier.complaints.size() - most);
    fmt::print(
        "{} records; truth recomputed for {}, {} frames rendered again{}\n", total, verifier.truths, verifier.rendered,
        verifier.planes_compared > 0 ? fmt::format(", {} with their truth planes", verifier.planes_compared) : "");
  }
  if (!verifier.complaints.empty())
    return fail(Error::Kind::Malformed,
                fmt::format("{}: {} differences: it is not what its run.yaml makes with this version and these maps",
                            folder.string(), verifier.complaints.size()));
  if (!json) fmt::print("all agree\n");
  return {};
}

}  // namespace
}  // namespace nadir::app

int main(int argc, char** argv) {
  CLI::App app(
      "Checks a dataset of nadir fly: recomputes the truth of every frame, renders some again and their truth planes, "
      "compares checksums and files.",
      "nadir verify");
  std::string folder;
  std::size_t frames = 10;
  std::uint64_t seed = 1;
  bool json = false;
  app.add_option("DIR", folder, "the dataset")->required();
  app.add_option("--frames", frames, "how many frames to render again, chosen at random")->capture_default_str();
  app.add_option("--seed", seed, "of that choice")->capture_default_str();
  app.add_flag("--json", json, "outcome for programs");
  app.footer("example: nadir verify flight --frames 50");
  return nadir::app::run_command(app, argc, argv, [&] { return nadir::app::run(folder, frames, seed, json); });
}
