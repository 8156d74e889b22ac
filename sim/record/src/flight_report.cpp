#include "nadir/record/flight_report.h"
#include "nadir/base/time.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "nadir/sim/rehearsal.h"

namespace nadir::record {
namespace {

using geodesy::to_degrees;

double worst_of(const Series& series, double settle_s) {
  double worst = 0;
  for (const ChartPoint& p : series.points)
    if (p.x >= settle_s && std::isfinite(p.y)) worst = std::max(worst, std::abs(p.y));
  return worst;
}

double median_of(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Along the planned path, near enough for a picture.
std::vector<Eigen::Vector2d> places_of(const sim::RunFile& run, const sim::PreparedVehicle& vehicle) {
  std::vector<Eigen::Vector2d> places;
  for (const sim::PlannedPoint& p : sim::planned_path(run, vehicle)) places.emplace_back(p.north_m, p.east_m);
  return places;
}

std::string or_dash(const std::string& text) { return text.empty() ? "-" : text; }

}  // namespace

FlightReport::FlightReport(const sim::Run& run) : run_(run) {
  for (const sim::PreparedVehicle& vehicle : run.vehicles()) {
    VehicleLog log{vehicle.name};
    log.height.name = "flown";
    log.commanded_height.name = "commanded";
    log.commanded_height.dashed = true;
    log.yaw.name = "yaw";
    log.pitch.name = "pitch";
    log.roll.name = "roll";
    log.airspeed.name = "airspeed";
    log.ground_speed.name = "ground speed";
    log.cross_track.name = "to the right of the path";
    log.height_error.name = "above the path";
    log.throttle.name = "throttle";
    vehicles_.push_back(std::move(log));
  }
  for (const sim::PreparedSensor& sensor : run.sensors()) {
    const double exposures = seconds_from_ns(run.file().duration_ns) * sensor.setup.rate.hz() + 1;
    const std::string name = sensor.vehicle + "/" + sensor.name;
    sensors_.push_back({sensor.vehicle,
                        sensor.name,
                        Overview(sensor.scene, sensor.camera, static_cast<std::size_t>(exposures)),
                        {name},
                        {name},
                        {name}});
    for (const sim::PreparedVehicle& vehicle : run.vehicles())
      if (vehicle.name == sensor.vehicle && vehicle.planned() && !vehicle.planned()->setup_item.empty())
        sensors_.back().overview.plan(places_of(run.file(), vehicle));
  }
}

Result<void> FlightReport::on_state(const std::string& vehicle, const sim::VehicleState& state) {
  for (VehicleLog& log : vehicles_) {
    if (log.name != vehicle) continue;
    const double t = seconds_from_ns(state.time_ns);
    const double ground_m = run_.ground().up_m();
    const double up_m =
        (run_.ground().frame().enu_from_ecef() * geodesy::Point<geodesy::frame::Ecef>{state.ecef_from_body.origin})
            .xyz.z();
    log.height.points.push_back({t, up_m - ground_m});
    const double yaw_deg = to_degrees(state.attitude.yaw_rad);
    if (!log.yaw.points.empty() && std::abs(yaw_deg - log.yaw.points.back().y) > 180)
      log.yaw.points.push_back({t});  // past north: a gap, not a fall
    log.yaw.points.push_back({t, yaw_deg});
    log.pitch.points.push_back({t, to_degrees(state.attitude.pitch_rad)});
    log.roll.points.push_back({t, to_degrees(state.attitude.roll_rad)});
    if (!state.flight) continue;
    log.flown = true;
    log.commanded_height.points.push_back({t, state.flight->commanded_height_m - ground_m});
    log.airspeed.points.push_back({t, state.flight->airspeed_mps});
    log.ground_speed.points.push_back({t, state.flight->velocity_ned_mps.head<2>().norm()});
    log.cross_track.points.push_back({t, state.flight->off_path_right_m});
    log.height_error.points.push_back({t, state.flight->off_path_above_m});
    log.throttle.points.push_back({t, state.flight->throttle});
  }
  return {};
}

Result<void> FlightReport::on_frame(const sim::FrameEvent& event) {
  for (SensorLog& log : sensors_) {
    if (log.vehicle != event.vehicle || log.name != event.sensor) continue;
    const double t = seconds_from_ns(event.state.time_ns);
    log.overview.add(event.truth, event.state.time_ns);
    if (event.frame) log.cost.points.push_back({t, event.truth.render_ms});
    if (event.frame || !event.rejected.empty()) log.valid.points.push_back({t, event.truth.valid_fraction});
    if (event.truth.image_gsd_m) log.gsd.points.push_back({t, *event.truth.image_gsd_m});

    const bool outside = !sim::on_map(event.truth);
    if (outside && !log.outside) log.excursions.push_back({event.state.time_ns, event.state.time_ns, 0});
    if (outside) {
      log.excursions.back().to_ns = event.state.time_ns;
      ++log.excursions.back().exposures;
    }
    log.outside = outside;
  }
  return {};
}

bool FlightReport::flown() const {
  return std::any_of(vehicles_.begin(), vehicles_.end(), [](const VehicleLog& log) { return log.flown; });
}

double FlightReport::settle_s() const { return run_.file().duration_ns >= 10'000'000'000 ? 5 : 0; }

double FlightReport::worst_cross_track_m() const {
  double worst = 0;
  for (const VehicleLog& log : vehicles_) worst = std::max(worst, worst_of(log.cross_track, settle_s()));
  return worst;
}

double FlightReport::worst_height_error_m() const {
  double worst = 0;
  for (const VehicleLog& log : vehicles_) worst = std::max(worst, worst_of(log.height_error, settle_s()));
  return worst;
}

std::vector<double> FlightReport::frame_ms() const {
  std::vector<double> values;
  for (const SensorLog& log : sensors_)
    for (const ChartPoint& p : log.cost.points) values.push_back(p.y);
  return values;
}

double FlightReport::mean_valid_fraction() const {
  double sum = 0;
  std::size_t count = 0;
  for (const SensorLog& log : sensors_)
    for (const ChartPoint& p : log.valid.points) sum += p.y, ++count;
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

std::map<std::string, std::vector<Excursion>> FlightReport::excursions() const {
  std::map<std::string, std::vector<Excursion>> found;
  for (const SensorLog& log : sensors_) found[log.vehicle + "/" + log.name] = log.excursions;
  return found;
}

std::vector<ReportItem> FlightReport::flight_charts(const VehicleLog& log) const {
  std::vector<ReportItem> charts;
  Chart height{log.name + ": height above the ground", "height / m", {log.height}};
  if (log.flown) height.series.push_back(log.commanded_height);
  charts.emplace_back(std::move(height));
  charts.emplace_back(Chart{log.name + ": attitude", "angle / degrees", {log.yaw, log.pitch, log.roll}});
  if (!log.flown) return charts;
  charts.emplace_back(Chart{log.name + ": speed", "speed / (m/s)", {log.airspeed, log.ground_speed}});
  charts.emplace_back(
      Chart{log.name + ": distance from the path", "distance / m", {log.cross_track, log.height_error}});
  return charts;
}

Section FlightReport::maps_section() const {
  Table table{"", {"map", "serves as", "CRS", "texel / m", "acquired", "licence", "attribution"}, {}};
  const auto add = [&](const std::string& name, const std::string& serves, const tile::Map& map) {
    const tile::MapDescription& d = map.description();
    table.rows.push_back({name, serves, map.projection().name(),
                          fmt::format("{:.3g} x {:.3g}", map.texel_size_m().x(), map.texel_size_m().y()),
                          or_dash(d.acquired), or_dash(d.licence), or_dash(d.attribution)});
  };
  for (const auto& [name, map] : run_.layers()) add(name, "sensor source", map);
  for (const auto& [name, map] : run_.onboard()) add(name, "onboard reference", map);
  return {"Maps", "", {std::move(table)}};
}

Result<void> FlightReport::write(render::Renderer& renderer, const std::filesystem::path& folder,
                                 const sim::RunSummary& summary, bool frames) const {
  const std::filesystem::path pictures = folder / "pictures";
  Report report{frames ? "Flight report" : "Rehearsal: where the cameras will look",
                fmt::format("{} s simulated in {:.1f} s", seconds_from_ns(summary.flown_ns), summary.seconds)};

  // The main figures
  const std::string when = settle_s() > 0 ? fmt::format("at most, after {} s", settle_s()) : "at most";
  if (frames) {
    report.figures.push_back({"frames", std::to_string(summary.frames), "",
                              summary.rejected > 0 ? fmt::format("{} rejected", summary.rejected) : ""});
    report.figures.push_back(
        {"frames a second",
         fmt::format("{:.1f}", static_cast<double>(summary.frames) / std::max(summary.seconds, 1e-9)), "",
         "written to disk"});
    report.figures.push_back(
        {"a frame takes", fmt::format("{:.1f}", median_of(frame_ms())), "ms", "median, in the renderer"});
    const double valid = mean_valid_fraction();
    report.figures.push_back({"on the map", fmt::format("{:.1f}", 100 * valid), "%", "of all pixels",
                              valid > 0.999 ? Figure::State::Good : Figure::State::Warn});
  }
  if (flown()) {
    report.figures.push_back({"off the path", fmt::format("{:.1f}", worst_cross_track_m()), "m", when});
    report.figures.push_back({"height error", fmt::format("{:.1f}", worst_height_error_m()), "m", when});
  }

  Section seen{"What the cameras saw"}, where{"Where they looked"}, cost{"Frames"}, flight{"Flight"};
  Chart cost_chart{"cost of a frame", "time / ms"}, valid_chart{"valid pixels", "share"},
      gsd_chart{"ground sample distance", "m / pixel"};
  List outside{"Exposures that leave the map", {}};
  for (const SensorLog& log : sensors_) {
    const render::Layer& layer = log.overview.scene().layers().front();
    const std::string name = log.vehicle + "_" + log.name;
    if (frames) {
      const auto path = pictures / ("contact_" + name + ".png");
      if (auto ok = log.overview.write_contact_sheet(renderer, layer, path); !ok) return ok;
      seen.items.emplace_back(Picture{path, fmt::format("{}/{}", log.vehicle, log.name)});
    }
    const auto path = pictures / ("footprints_" + name + ".png");
    if (auto ok = log.overview.write_footprints(renderer, layer, path); !ok) return ok;
    where.items.emplace_back(Picture{path, fmt::format("{}/{}", log.vehicle, log.name)});
    cost_chart.series.push_back(log.cost);
    valid_chart.series.push_back(log.valid);
    gsd_chart.series.push_back(log.gsd);
    for (const Excursion& e : log.excursions)
      outside.lines.push_back(fmt::format("{}/{}: {} exposures from {:.2f} s to {:.2f} s", log.vehicle, log.name,
                                          e.exposures, seconds_from_ns(e.from_ns), seconds_from_ns(e.to_ns)));
  }
  if (outside.lines.empty()) outside.lines.push_back("none: every exposure lies on its map");
  where.items.emplace_back(std::move(outside));
  for (const VehicleLog& log : vehicles_)
    for (ReportItem& chart : flight_charts(log)) flight.items.push_back(std::move(chart));
  List motion{"how the motion is stepped"};
  for (const sim::PreparedVehicle& vehicle : run_.vehicles())
    if (const sim::MotionPlan* plan = vehicle.source->motion_plan())
      motion.lines.push_back(fmt::format("{}: {}: {}", vehicle.name, to_string(plan->scheme), plan->why));
  List events{"events", {}};
  for (const sim::RunEvent& event : summary.events) events.lines.push_back(in_words(event));
  if (!events.lines.empty()) flight.items.emplace_back(std::move(events));
  if (!motion.lines.empty()) flight.items.emplace_back(std::move(motion));
  if (frames) {
    cost.items.emplace_back(std::move(cost_chart));
    cost.items.emplace_back(Histogram{"how long frames take", "time / ms", frame_ms()});
    cost.items.emplace_back(std::move(valid_chart));
  }
  cost.items.emplace_back(std::move(gsd_chart));

  Section plan{"The plan", "How the first frame of each sensor was made, and what the scene did not need."};
  plan.items.emplace_back(List{"done", summary.plan_done});
  plan.items.emplace_back(List{"left out", summary.plan_left_out});
  if (frames) report.sections.push_back(std::move(seen));
  report.sections.push_back(std::move(where));
  report.sections.push_back(std::move(flight));
  report.sections.push_back(std::move(cost));
  report.sections.push_back(maps_section());
  if (frames) report.sections.push_back(std::move(plan));
  return write_report(folder / "report.html", report);
}

}  // namespace nadir::record
