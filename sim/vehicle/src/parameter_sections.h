#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "nadir/sim/contact.h"
#include "nadir/sim/parameter_layer.h"
#include "nadir/sim/propulsion.h"
#include "nadir/sim/rigid_body.h"

namespace nadir::sim {

// Bounds of what a number can be in its unit: outside them a unit is mistaken, not the vehicle unusual.
inline constexpr ParameterRange length_range = {0, 100, true, "is it in millimetres?"},
                                place_range = {-100, 100, false, "is it in millimetres?"},
                                voltage_range = {0, 2000, true}, current_range = {0, 1000},
                                lag_range = {0, 5, false, "is it in milliseconds?"};

/// Notes what is wrong with the numbers of a section together, where none was noted of it since `before`.
void note_faults(const YamlMap& yaml, std::size_t before, std::span<const ParameterFault> faults);

/// Sections that several kinds of vehicles have. Mass and inertia: false where they have faults.
bool read_mass(const ParameterLayer& layer, MassProperties& mass);
std::string mass_text(const MassProperties& mass);

/// A motor with its propeller.
void read_electric(const ParameterLayer& layer, Propulsion& motor);
std::string electric_text(const Propulsion& motor);

/// Points by name; those of a gear that is there already are changed, others added behind them.
void read_gear(const ParameterLayer& layer, std::optional<ContactGear>& gear);
std::string gear_text(const ContactGear& gear);
/// On the ground: what it would stand on, and how far down.
void warn_of_gear(const ContactGear& gear, double mass_kg, std::vector<std::string>& warnings);

/// The part of that name; a new one like `fresh` behind the others where there is none, as `added` says.
template <class Part>
struct NamedPart {
  NamedPart(std::vector<Part>& parts, const std::string& name, const Part& fresh) {
    auto found = std::find_if(parts.begin(), parts.end(), [&](const Part& p) { return p.name == name; });
    added = found == parts.end();
    if (added) {
      parts.push_back(fresh);
      parts.back().name = name;
      found = parts.end() - 1;
    }
    part = &*found;
  }
  Part* part;
  bool added;
};

/// One of several kinds that a section can be of. A layer that changes some parameters of the kind that is there may
/// leave out the others; another kind needs all.
template <class Kind, class Variant, class Read>
void read_kind(const ParameterLayer& layer, std::string_view key, Variant& variant, Read&& read) {
  const auto yaml = layer.yaml().map(key);
  if (!yaml) return;
  const bool same = std::holds_alternative<Kind>(variant);
  Kind kind = same ? std::get<Kind>(variant) : Kind{};
  read(ParameterLayer(*yaml, layer.complete() || !same), kind);
  variant = kind;
}

}  // namespace nadir::sim
