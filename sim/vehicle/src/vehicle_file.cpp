#include "nadir/sim/vehicle_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <memory>
#include <mutex>

#include "nadir/base/files.h"
#include "nadir/base/text.h"
#include "vehicle_kinds.h"
#include "vehicle_models.h"

namespace nadir::sim {
namespace {

constexpr std::array<std::string_view, 2> kind_names = {"fixed_wing", "multirotor"};  // in the order of the variant

/// Of a map that has not said its kind, which is a fault: that which its other keys are of. Asks for keys.
bool looks_like_multirotor(const YamlMap& yaml) {
  return yaml.has("rotors") || yaml.has("lumped") || yaml.has("drive") || yaml.has("battery");
}

template <class Kind>
VehicleParameters read_layer(const YamlMap& yaml, bool complete, Kind vehicle) {
  apply(ParameterLayer(yaml, complete), vehicle);
  return vehicle;
}

/// In the place of a vehicle that could not be read, so that the faults of what differs from it are told too.
VehicleParameters stand_in(const YamlMap& yaml) {
  return vehicle_model(looks_like_multirotor(yaml) ? "multirotor" : "aerosonde").value();
}

/// Of the kind that the map says or, where it does not, seems to be of.
VehicleParameters read_complete(const YamlMap& yaml) {
  yaml.require("kind");
  const auto name = yaml.text("kind");
  const auto kind = std::find(kind_names.begin(), kind_names.end(), name.value_or(""));
  const bool known = kind != kind_names.end();
  if (name && !known)
    yaml.fault("kind", fmt::format("expected {} or {}, found '{}'", kind_names[0], kind_names[1], *name));
  const bool multirotor = known ? kind != kind_names.begin() : looks_like_multirotor(yaml);
  return multirotor ? read_layer(yaml, true, Multirotor{}) : read_layer(yaml, true, FixedWing{});
}

VehicleParameters read_changes(const YamlMap& yaml, VehicleParameters base) {
  if (const auto name = yaml.text("kind"); name && *name != kind_names[base.index()])
    yaml.fault("kind", fmt::format("expected {}, which the vehicle is that it changes, found '{}'",
                                   kind_names[base.index()], *name));
  return std::visit([&](auto& vehicle) { return read_layer(yaml, false, std::move(vehicle)); }, base);
}

VehicleParameters read_upon_base(const YamlMap& yaml) {
  const auto name = yaml.text("base");
  if (!name) return read_complete(yaml);
  const auto base = yaml.value_of("base", vehicle_model(*name));
  return read_changes(yaml, base ? *base : stand_in(yaml));
}

/// What a file gives: a vehicle, even where it has faults, or none where it is no map at all.
struct FileRead {
  std::unique_ptr<VehicleParameters> vehicle;
  Result<void> faults;
};
FileRead read_text(const std::string& file_name, const std::string& text) {
  const auto yaml = YamlMap::parse(file_name, text);
  if (!yaml) return {nullptr, fail(yaml)};
  auto vehicle = std::make_unique<VehicleParameters>(read_upon_base(*yaml));
  return {std::move(vehicle), yaml->finish()};
}
FileRead read_file(const std::filesystem::path& path) {
  const auto text = read_text_file(path);
  if (!text) return {nullptr, fail(text)};
  return read_text(path.string(), *text);
}
Result<VehicleParameters> without_faults(FileRead read) {
  if (!read.faults) return fail(read.faults);
  return std::move(*read.vehicle);
}

template <class Kind>
Result<Kind> model_of_kind(std::string_view name, std::string_view kind) {
  auto vehicle = vehicle_model(name);
  if (!vehicle) return fail(vehicle);
  if (auto* found = std::get_if<Kind>(&*vehicle)) return std::move(*found);
  return fail(Error::Kind::NotFound, fmt::format("model '{}' is no {}", name, kind));
}

}  // namespace

std::vector<std::string_view> vehicle_models() {
  std::vector<std::string_view> names;
  for (const VehicleModelText& model : vehicle_model_texts()) names.push_back(model.name);
  return names;
}

Result<VehicleParameters> vehicle_model(std::string_view name) {
  // Each is read once: who flies many of them asks many times
  static std::mutex mutex;
  static std::map<std::string, VehicleParameters, std::less<>> known;
  {
    const std::scoped_lock lock(mutex);
    if (const auto found = known.find(name); found != known.end()) return found->second;
  }
  for (const VehicleModelText& model : vehicle_model_texts()) {
    if (model.name != name) continue;
    auto vehicle = parse_vehicle(std::string(name), std::string(model.yaml));
    if (!vehicle) return vehicle;
    const std::scoped_lock lock(mutex);
    return known.emplace(name, std::move(*vehicle)).first->second;
  }
  return fail(Error::Kind::NotFound, fmt::format("no model '{}'{}", name, suggestion(name, vehicle_models())));
}

Result<FixedWing> fixed_wing_model(std::string_view name) { return model_of_kind<FixedWing>(name, "fixed wing"); }
Result<Multirotor> multirotor_model(std::string_view name) { return model_of_kind<Multirotor>(name, "multirotor"); }

VehicleParameters read_vehicle(const YamlMap& yaml, const std::filesystem::path& folder) {
  const auto file = yaml.text("file");
  if (!file) return read_upon_base(yaml);
  if (yaml.has("base")) yaml.fault("base", "expected it or file, found both");
  FileRead read = read_file((folder / *file).lexically_normal());
  if (!read.faults) yaml.fault("file", read.faults.error().message);
  return read_changes(yaml, read.vehicle ? std::move(*read.vehicle) : stand_in(yaml));
}

Result<VehicleParameters> parse_vehicle(const std::string& file_name, const std::string& text) {
  return without_faults(read_text(file_name, text));
}

Result<VehicleParameters> read_vehicle_file(const std::filesystem::path& path) {
  return without_faults(read_file(path));
}

std::vector<std::string> vehicle_warnings(const VehicleParameters& vehicle) {
  return std::visit([](const auto& v) { return warnings_of(v); }, vehicle);
}

std::string to_yaml(const VehicleParameters& vehicle, std::string_view indent) {
  std::string text;
  const std::string all = fmt::format("kind: {}\n", kind_names[vehicle.index()]) +
                          std::visit([](const auto& v) { return text_of(v); }, vehicle);
  for (std::size_t from = 0, end; from < all.size(); from = end) {
    end = all.find('\n', from) + 1;
    text += std::string(indent) + all.substr(from, end - from);
  }
  return text;
}

}  // namespace nadir::sim
