#include "nadir/sim/ground_contact.h"

#include <algorithm>

#include "nadir/geodesy/attitude.h"

namespace nadir::sim::contact_parts {
using Eigen::Vector3d;

Planes planes_under(const Ground& ground, const ContactGear& gear, const Vector3d& origin_ecef,
                    const Eigen::Matrix3d& ecef_from_body) {
  const auto plane = [&](const Vector3d& off_m) {
    const GroundUnder under = ground.under({origin_ecef + off_m});
    return Planes::Plane{under.normal_ecef, under.height_m - under.normal_ecef.dot(off_m)};
  };
  Planes planes;
  planes.of_center = plane(Vector3d::Zero());
  for (std::size_t i = 0; i < gear.points().size(); ++i)
    planes.of_point[i] = plane(ecef_from_body * gear.points()[i].body_m);
  return planes;
}

namespace {

double depth_m(const ContactGear& gear, const Planes& planes, const Body& body, int point) {
  const auto i = static_cast<std::size_t>(point);
  const Vector3d at = body.offset_m + body.ecef_from_body * gear.points()[i].body_m;
  return -(planes.of_point[i].height_m + planes.of_point[i].normal.dot(at));
}

int count(const ContactGear& gear) { return static_cast<int>(gear.points().size()); }

}  // namespace

ContactMotion motion_of(const ContactGear& gear, const Planes& planes, const Body& body, int point) {
  const auto i = static_cast<std::size_t>(point);
  return {.depth_m = depth_m(gear, planes, body, point),
          .velocity_mps = body.velocity_mps + body.ecef_from_body * body.rates_radps.cross(gear.points()[i].body_m),
          .normal = planes.of_point[i].normal,
          .forward = body.ecef_from_body.col(0),
          .up = -body.ecef_from_body.col(2)};
}

Loads loads_on(const ContactGear& gear, const Planes& planes, const Body& body, const GearCommand& command) {
  Loads sum;
  for (int i = 0; i < count(gear); ++i) {
    if (depth_m(gear, planes, body, i) <= 0) continue;
    const ContactPoint& point = gear.points()[static_cast<std::size_t>(i)];
    const Vector3d force =
        body.ecef_from_body.transpose() * contact_force(point, motion_of(gear, planes, body, i), command).force_n;
    sum = sum + Loads{force, point.body_m.cross(force)};
  }
  return sum;
}

bool can_touch(const ContactGear& gear, const Planes& planes, const Body& body, double duration_s) {
  for (int i = 0; i < count(gear); ++i) {
    const auto at = static_cast<std::size_t>(i);
    const double speed_mps = std::abs(planes.of_point[at].normal.dot(body.velocity_mps)) +
                             body.rates_radps.norm() * gear.points()[at].body_m.norm();
    if (-depth_m(gear, planes, body, i) <= speed_mps * duration_s + reserve_m(duration_s)) return true;
  }
  return false;
}

void note(const ContactGear& gear, const Planes& planes, const Body& before, double before_s, const Body& after,
          double after_s, const GearCommand& command, ContactReport& report) {
  for (int i = 0; i < count(gear); ++i) {
    const ContactPoint& point = gear.points()[static_cast<std::size_t>(i)];
    const double from_m = depth_m(gear, planes, before, i), to_m = depth_m(gear, planes, after, i);
    if (to_m <= 0) continue;
    // Where it met the ground, were its speed even
    const double met_s = from_m < 0 ? before_s + (after_s - before_s) * from_m / (from_m - to_m) : before_s;
    if (point.kind == ContactPoint::Kind::Part) {
      if (!report.part || met_s < report.part->time_s) report.part = {i, met_s};
      continue;
    }
    const ContactMotion now = motion_of(gear, planes, after, i);
    if (from_m <= 0) {
      const ContactMotion then = motion_of(gear, planes, before, i);
      report.met |= 1u << i;
      report.impact_mps =
          std::max({report.impact_mps, -now.normal.dot(now.velocity_mps), -now.normal.dot(then.velocity_mps)});
    }
    const double force_n = contact_force(point, now, command).normal_n;
    if (force_n > report.most_n) report.most_n = force_n, report.most_loaded = i;
    if (point.most_n > 0 && force_n > point.most_n && !report.broken) report.broken = {i, after_s};
  }
}

std::uint32_t touching(const ContactGear& gear, const Planes& planes, const Body& body) {
  std::uint32_t bits = 0;
  for (int i = 0; i < count(gear); ++i)
    if (gear.points()[static_cast<std::size_t>(i)].kind != ContactPoint::Kind::Part &&
        depth_m(gear, planes, body, i) > 0)
      bits |= 1u << i;
  return bits;
}

}  // namespace nadir::sim::contact_parts

namespace nadir::sim {

BodyState standing_body(const Environment& environment, const ContactGear& gear, const Ground& ground,
                        const geodesy::Geodetic& place, double yaw_rad) {
  BodyState state;
  state.position = geodesy::ecef_from_geodetic(place);
  const Surroundings here = environment.at(state.position);
  const GroundUnder under = ground.under(state.position);
  const auto tilt = Eigen::Quaterniond::FromTwoVectors(-here.ecef_from_ned.col(2), under.normal_ecef);
  state.ecef_from_body.quaternion =
      (tilt * Eigen::Quaterniond(here.ecef_from_ned) * geodesy::quaternion_from({yaw_rad, 0, 0})).normalized();
  double lowest_m = 0;
  for (const ContactPoint& point : gear.points()) lowest_m = std::max(lowest_m, point.body_m.z());
  state.position.xyz -= (under.height_m - lowest_m) * under.normal_ecef;
  state.body_rates_radps = state.ecef_from_body.quaternion.conjugate() * here.earth_rate_ecef_radps;
  return state;
}

}  // namespace nadir::sim
