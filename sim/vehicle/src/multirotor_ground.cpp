#include "nadir/sim/multirotor_ground.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace nadir::sim {
namespace {

using Eigen::Vector3d;
using Kind = ContactPoint::Kind;

constexpr double weight_per_kg_n = 9.80665;

/// Where rotors are, for a gear to stand clear of them.
struct Hubs {
  Vector3d reach_m = Vector3d::Zero();  // forward, right; z: of the lowest, below the centre of mass
  double distance_m = 0;                // of the farthest from the centre of mass, level
  double top_m = 0;                     // of the highest, above the centre of mass
  double radius_m = 0;                  // of the greatest rotor
};

Hubs hubs_of(const Multirotor& vehicle) {
  Hubs hubs;
  if (vehicle.lumped) {
    const double gyration_m = std::sqrt(vehicle.mass.inertia_kgm2()(2, 2) / vehicle.mass.mass_kg());
    hubs.reach_m = {gyration_m, gyration_m, 0};
    hubs.distance_m = hubs.reach_m.norm();
    hubs.radius_m = vehicle.lumped->rotor_radius_m;
    return hubs;
  }
  for (const Rotor& rotor : vehicle.rotors) {
    const Vector3d& at = rotor.position_m;
    hubs.reach_m = hubs.reach_m.cwiseMax(Vector3d(std::abs(at.x()), std::abs(at.y()), at.z()));
    hubs.distance_m = std::max(hubs.distance_m, at.head<2>().norm());
    hubs.top_m = std::max(hubs.top_m, -at.z());
    hubs.radius_m = std::max(hubs.radius_m, radius_m(rotor));
  }
  return hubs;
}

/// Farthest out of a rotor's disc.
Vector3d tip_m(const Vector3d& hub, const Vector3d& axis, double radius_m) {
  const Vector3d out = Vector3d(hub.x(), hub.y(), 0) - axis.dot(Vector3d(hub.x(), hub.y(), 0)) * axis;
  return out.norm() > 1e-6 ? Vector3d(hub + radius_m * out.normalized()) : hub;
}

}  // namespace

ContactGear gear_of(const Multirotor& vehicle) {
  if (vehicle.gear) return *vehicle.gear;
  const Hubs hubs = hubs_of(vehicle);
  std::vector<ContactPoint> points;

  // Skids. Rotors in one line or one place still stand on four
  constexpr double sag_m = 0.004, damping_share = 0.3, most_weights = 7;
  const double weight_n = weight_per_kg_n * vehicle.mass.mass_kg();
  const double least_m = std::max(0.3 * hubs.distance_m, 0.05);
  const double forward_m = std::max(0.8 * hubs.reach_m.x(), least_m);
  const double right_m = std::max(0.8 * hubs.reach_m.y(), least_m);
  const double down_m = std::max(0.6 * hubs.distance_m, least_m) + std::max(hubs.reach_m.z(), 0.0);
  for (const bool front : {true, false})
    for (const bool right : {false, true})
      points.push_back({.name = fmt::format("{} {} skid", front ? "front" : "rear", right ? "right" : "left"),
                        .kind = Kind::Skid,
                        .body_m = {front ? forward_m : -forward_m, right ? right_m : -right_m, down_m},
                        .stiffness_npm = weight_n / 4 / sag_m,
                        .damping_spm = 2 * damping_share / std::sqrt(sag_m * weight_per_kg_n),
                        .most_n = most_weights * weight_n});

  // What may not touch
  const auto part = [&](std::string name, const Vector3d& at) {
    points.push_back({.name = std::move(name), .kind = Kind::Part, .body_m = at});
  };
  if (vehicle.lumped)
    for (const double x : {1.0, -1.0})
      for (const double y : {-1.0, 1.0}) {
        const Vector3d hub(x * hubs.reach_m.x(), y * hubs.reach_m.y(), 0);
        part(fmt::format("{} {} rotor", x > 0 ? "front" : "rear", y > 0 ? "right" : "left"),
             tip_m(hub, -Vector3d::UnitZ(), hubs.radius_m));
      }
  for (std::size_t i = 0; i < vehicle.rotors.size(); ++i) {
    const Rotor& rotor = vehicle.rotors[i];
    part(fmt::format("rotor {}", i + 1), tip_m(rotor.position_m, rotor.thrust_axis, radius_m(rotor)));
  }
  part("belly", {0, 0, down_m / 3});
  part("top", {0, 0, -hubs.top_m - down_m / 3});
  return ContactGear::create(std::move(points)).value();
}

template <class Vector>
GroundContact<Vector> ground_for(const Multirotor& vehicle, std::shared_ptr<const Ground> ground,
                                 const Environment& environment, const Vector& like) {
  Tolerance<Vector> tolerance = GroundContact<Vector>::usual_tolerance(like);
  // Speeds of rotors and currents matter to a body by what they lift
  tolerance.absolute.tail(like.size() - 13).setConstant(1e-3);
  const double low_m =
      vehicle.ground_effect.law == GroundEffect::Law::None ? 0 : ground_effect_radii * hubs_of(vehicle).radius_m;
  // Any place tells how the Earth turns
  const auto earth_rate = environment.at(geodesy::ecef_from_geodetic({})).earth_rate_ecef_radps;
  return {gear_of(vehicle), std::move(ground), earth_rate, low_m, std::move(tolerance)};
}
template GroundContact<BodyVector> ground_for(const Multirotor&, std::shared_ptr<const Ground>, const Environment&,
                                              const BodyVector&);
template GroundContact<MultirotorVector> ground_for(const Multirotor&, std::shared_ptr<const Ground>,
                                                    const Environment&, const MultirotorVector&);

}  // namespace nadir::sim
