// nadir doctor: what to expect of a run, before it runs.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "command.h"
#include "nadir/base/text.h"
#include "nadir/base/time.h"
#include "nadir/render/truth_planes.h"
#include "nadir/sim/preflight.h"
#include "nadir/sim/rehearsal.h"
#include "nadir/sim/run.h"
#include "nadir/sim/vehicle_file.h"

namespace nadir::app {
namespace {

using Json = nlohmann::ordered_json;

struct Finding {
  enum class Kind { Good, Note, Warning, Impossible };
  Kind kind;
  std::string text;
};

constexpr std::size_t most_looked_at = 6;  // exposures of each sensor

class Doctor {
 public:
  void note(Finding::Kind kind, std::string text) { findings_.push_back({kind, std::move(text)}); }

  void look_at_map(const std::string& name, const std::string& serves, const tile::Map& map) {
    const tile::MapDescription& d = map.description();
    note(Finding::Kind::Good, fmt::format("{} {}: {}, {}, {} x {} texels of {:.4g} x {:.4g} m on the ground", serves,
                                          name, d.path, map.projection().name(), map.width(), map.height(),
                                          map.texel_size_m().x(), map.texel_size_m().y()));
    note(Finding::Kind::Good, fmt::format("{}: datum {}{}", name, map.projection().datum(),
                                          map.projection().uses_library() ? ", related to WGS-84 by PROJ" : ""));
    if (!map.projection().uses_library())
      note(Finding::Kind::Good, fmt::format("{}: its CRS has a closed form: no projection library is loaded", name));
    if (d.licence.empty())
      note(Finding::Kind::Note,
           fmt::format("{}: the file states no licence: check that you may use what you make of it", name));
    if (d.acquired.empty())
      note(Finding::Kind::Note, fmt::format("{}: the file does not say when it was acquired", name));
    for (const std::string& warning : d.warnings) note(Finding::Kind::Note, fmt::format("{}: {}", name, warning));
  }

  Result<void> look_at_sensor(const sim::Run& run, const sim::PreparedSensor& sensor,
                              const std::vector<sim::Rehearsal::Exposure>& exposures, std::size_t count,
                              render::Renderer& renderer) {
    const std::string name = sensor.vehicle + "/" + sensor.name;
    double least = 1e300, most = 0, warm_ms = 0, cold_ms = 0, geometry_px = 0;
    std::size_t on_map = 0;
    const std::size_t looked_at = std::min(most_looked_at, exposures.size());
    for (std::size_t k = 0; k < looked_at; ++k) {
      const auto& [state, truth] = exposures[k * exposures.size() / looked_at];
      if (truth.magnification)
        least = std::min(least, *truth.magnification), most = std::max(most, *truth.magnification);
      render::RenderOptions options = run.render_options(sensor);
      options.off_map = render::OffMap::Mask;
      for (double* ms : {&cold_ms, &warm_ms}) {
        const auto frame = renderer.render(sensor.scene, sensor.camera, sim::camera_pose(state, sensor), options);
        if (!frame) return fail(frame.error().kind, fmt::format("sensor {}: {}", name, frame.error().message));
        *ms += frame->truth().render_ms / static_cast<double>(looked_at);
        geometry_px = std::max(geometry_px, frame->truth().geometry_error_px);
        if (ms == &warm_ms) on_map += frame->truth().valid_fraction > 0.999;
      }
    }
    if (exposures.empty()) return {};
    if (sensor.fitted)
      note(sensor.fitted->fits() ? Finding::Kind::Good : Finding::Kind::Warning,
           fmt::format("{}: {} (this machine, now)", name, to_string(*sensor.fitted)));
    const auto pixels =
        static_cast<std::uint64_t>(sensor.camera.width_px()) * static_cast<std::uint64_t>(sensor.camera.height_px());
    std::uint64_t planes_bytes = 0;
    if (run.file().record_frames && run.file().record_truth_planes) {
      const auto start = std::chrono::steady_clock::now();
      render::truth_planes({sensor.camera, sim::camera_pose(exposures.front().state, sensor), sensor.scene.surface()});
      const double planes_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      note(Finding::Kind::Note, fmt::format("{}: its truth planes take {:.0f} ms a frame", name, 1e3 * planes_s));
      work_s_ += static_cast<double>(count) * planes_s;
      planes_bytes = pixels * (2 * sizeof(double) + 4 * sizeof(float));
    }
    note(Finding::Kind::Good, fmt::format("{}: {} frames of {} x {} at {:g} Hz; {:.1f} ms each once its tiles are "
                                          "read, {:.1f} ms before (this machine, now)",
                                          name, count, sensor.camera.width_px(), sensor.camera.height_px(),
                                          sensor.setup.rate.hz(), warm_ms, cold_ms));
    work_s_ += static_cast<double>(count) * warm_ms * 1e-3;
    if (most > 0) {
      const Finding::Kind kind = most > 4 ? Finding::Kind::Warning : Finding::Kind::Good;
      note(kind,
           fmt::format(
               "{}: a texel is {:.2g} to {:.2g} image pixels{}", name, least, most,
               most > 4
                   ? ": the map is coarser than the camera and frames will be smooth; fly higher, or use a finer map"
                   : ""));
    } else {
      note(Finding::Kind::Warning, fmt::format("{}: sees no ground in the middle of any frame looked at", name));
    }
    note(on_map == looked_at ? Finding::Kind::Good : Finding::Kind::Warning,
         fmt::format("{}: {} of {} frames looked at lie wholly on the map{}", name, on_map, looked_at,
                     on_map == looked_at ? "" : "; `nadir fly --dry-run` draws where"));
    note(Finding::Kind::Good, fmt::format("{}: geometry within {:.2g} px of exact (tolerance {} px)", name, geometry_px,
                                          run.file().geometry_tolerance_px));
    const tile::CellSource& source = *sensor.scene.layers().front().source;
    frame_bytes_ =
        std::max(frame_bytes_, pixels * (source.bands().size() * tile::size_bytes(source.type()) + 1) + planes_bytes);
    return {};
  }

  /// Whether it can be flown as planned.
  Result<bool> look_at_plans(const sim::Run& run) {
    const auto findings = sim::preflight(run);
    if (!findings) return fail(findings);
    bool possible = true;
    for (const sim::PreflightFinding& f : *findings) {
      note(f.impossible ? Finding::Kind::Impossible : Finding::Kind::Warning, f.message);
      possible = possible && !f.impossible;
    }
    for (const sim::PreparedVehicle& vehicle : run.vehicles())
      if (const sim::PlannedMission* planned = vehicle.planned())
        for (const sim::PlannedSurvey& s : planned->surveys)
          note(Finding::Kind::Good,
               fmt::format(
                   "{}: surveys in {} lines {:.1f} m apart towards {:.0f} degrees, at {:.3f} Hz for an exposure "
                   "every {:.1f} m; each point is seen at least {} times",
                   vehicle.name, s.lines, s.line_spacing_m, std::fmod(geodesy::to_degrees(s.heading_rad) + 360, 360),
                   s.rate_hz, s.exposure_spacing_m, s.seen_at_least));
    if (findings->empty()) note(Finding::Kind::Good, "missions: can be flown as planned");
    return possible;
  }

  void look_at_whole(const sim::Run& run, std::uint64_t cache_bytes, double flight_s) {
    const double duration_s = seconds_from_ns(run.file().duration_ns);
    note(Finding::Kind::Good, fmt::format("flying {} s without rendering took {:.2f} s; rendering adds about {:.0f} s, "
                                          "and writing images as much again on the other core",
                                          run.file().duration_text, flight_s, work_s_));
    if (work_s_ > duration_s)
      note(Finding::Kind::Note, fmt::format("that is slower than real time ({:.2g} of it): fine unless something waits",
                                            duration_s / work_s_));
    constexpr std::uint64_t programs_bytes = 180ull
                                             << 20;  // libraries, OpenImageIO among them, and three frames in flight
    const std::uint64_t kept = render::RendererOptions{}.spare_frame_bytes;  // of frames that are gone
    const std::uint64_t need = cache_bytes + programs_bytes + 4 * frame_bytes_ + kept;
    const auto machine =
        static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
    note(need < machine ? Finding::Kind::Good : Finding::Kind::Warning,
         fmt::format("memory: at most about {}, of the machine's {}", format_bytes(need), format_bytes(machine)));
  }

  void print(bool json) const {
    static constexpr const char *marks[] = {"ok  ", "note", "WARN", "FAIL"},
                                *names[] = {"good", "note", "warning", "impossible"};
    bool warned = false;
    Json list = Json::array();
    for (const Finding& f : findings_) {
      warned = warned || f.kind >= Finding::Kind::Warning;
      if (json)
        list.push_back({{"kind", names[static_cast<int>(f.kind)]}, {"text", f.text}});
      else
        fmt::print("{}  {}\n", marks[static_cast<int>(f.kind)], f.text);
    }
    if (json)
      fmt::print("{}\n",
                 Json{{"findings", list}, {"warnings", warned}}.dump(2, ' ', false, Json::error_handler_t::replace));
  }

 private:
  std::vector<Finding> findings_;
  double work_s_ = 0;
  std::uint64_t frame_bytes_ = 0;
};

Result<void> run(const std::string& path, const std::string& cache, bool json) {
  const auto cache_bytes = parse_bytes(cache);
  if (!cache_bytes) return fail(cache_bytes.error().kind, "--cache: " + cache_bytes.error().message);
  const auto file = sim::read_run_file(path);
  if (!file) return fail(file);
  auto run = sim::Run::prepare(*file);
  if (!run) return fail(run);

  Doctor doctor;
  for (const auto& [name, map] : run->layers()) doctor.look_at_map(name, "sensor source", map);
  for (const auto& [name, map] : run->onboard()) doctor.look_at_map(name, "onboard reference", map);
  const geodesy::Geodetic& origin = run->ground().frame().origin();
  std::string datum = "no geoid grid installed";
  if (const auto geoid_m = geodesy::geoid_height_m(origin.lat_rad, origin.lon_rad))
    datum = fmt::format("{:.1f} m above the {} geoid", run->ground().height_m() - *geoid_m, geodesy::geoid_name);
  doctor.note(Finding::Kind::Good,
              fmt::format("ground: {} {:.1f} m above the WGS-84 ellipsoid, {}, at {:.6f}, {:.6f}",
                          run->ground().plane() ? "a plane" : "the curved Earth", run->ground().height_m(), datum,
                          geodesy::to_degrees(origin.lat_rad), geodesy::to_degrees(origin.lon_rad)));
  for (const auto& [name, vehicle] : file->vehicles)
    if (vehicle.model != "poses")
      for (const std::string& warning :
           sim::vehicle_warnings(vehicle.multirotor ? vehicle.multirotor_vehicle() : vehicle.vehicle()))
        doctor.note(Finding::Kind::Note, fmt::format("{}: {}", name, warning));

  const auto possible = doctor.look_at_plans(*run);
  if (!possible) return fail(possible);
  if (!*possible) {
    doctor.print(json);
    return fail(Error::Kind::Malformed, "cannot be flown as planned");
  }

  render::Renderer renderer({.cache_bytes = *cache_bytes});
  sim::Rehearsal rehearsal(*run, most_looked_at);
  sim::Sink* const sinks[] = {&rehearsal};
  const auto flown = run->execute(renderer, sinks, /*render_frames=*/false, /*pace=*/0);
  if (!flown) return fail(flown);
  if (const sim::RunEvent* end = flown->ended())
    doctor.note(Finding::Kind::Warning, fmt::format("the run ends early: {}", in_words(*end)));
  if (auto ok = run->fit_time_budgets(renderer); !ok) return ok;
  for (std::size_t i = 0; i < run->sensors().size(); ++i)
    if (auto ok = doctor.look_at_sensor(*run, run->sensors()[i], rehearsal.kept(i), rehearsal.count(i), renderer); !ok)
      return ok;
  doctor.look_at_whole(*run, *cache_bytes, flown->seconds);
  doctor.print(json);
  return {};
}

}  // namespace
}  // namespace nadir::app

int main(int argc, char** argv) {
  CLI::App app(
      "Looks at a run before it runs: maps, datum, resolution, licence, whether missions can be flown, memory and "
      "time to expect.",
      "nadir doctor");
  std::string path, cache = "256MiB";
  bool json = false;
  app.add_option("RUN", path, "run file, YAML")->required();
  app.add_option("--cache", cache, "memory for decoded map tiles, as the run will have")->capture_default_str();
  app.add_flag("--json", json, "findings for programs");
  app.footer("example: nadir doctor spain.yaml");
  return nadir::app::run_command(app, argc, argv, [&] { return nadir::app::run(path, cache, json); });
}
