#include "nadir/sim/contact.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "nadir/sim/landing_gear.h"
#include "nadir/sim/step.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;
using geodesy::Geodetic;
using Kind = ContactPoint::Kind;

const Geodetic origin = Geodetic::degrees(38.1, -0.76, 0);
constexpr double g = 9.81;

/// A body on contact points over the plane of the origin, under gravity and a force of its own.
class Sled {
 public:
  explicit Sled(std::vector<ContactPoint> points, double gravity_mps2 = g)
      : environment_(Environment::flat(origin, gravity_mps2)),
        ground(ContactGear::create(std::move(points)).value(),
               std::make_shared<PlaneGround>(geodesy::LocalFrame(origin), 0), Vector3d::Zero(), 0,
               GroundContact<BodyVector>::usual_tolerance(BodyVector::Zero())) {
    BodyState state;
    state.position = geodesy::ecef_from_geodetic(origin);
    state.ecef_from_body.quaternion = geodesy::ecef_from_ned(origin).rotation;
    x = to_vector(state);
  }

  void place(const Vector3d& ned_m, const Vector3d& velocity_ned_mps) {
    x.head<3>() = geodesy::ecef_from_geodetic(origin).xyz + axes() * ned_m;
    x.segment<3>(3) = axes() * velocity_ned_mps;
  }
  Vector3d position_ned() const { return axes().transpose() * (x.head<3>() - geodesy::ecef_from_geodetic(origin).xyz); }
  Vector3d velocity_ned() const { return axes().transpose() * x.segment<3>(3); }
  double energy_j() const {
    return mass.mass_kg() * (0.5 * x.segment<3>(3).squaredNorm() - g * position_ned().z()) +
           0.5 * x.tail<3>().dot(mass.inertia_kgm2() * x.tail<3>());
  }

  ContactReport step(double dt_s = 0.0025) {
    const auto motion = [&](double, const BodyVector& at, const Loads& of_ground, double) {
      const BodyState state = body_state_from_vector(at);
      const BodyInAir in_air = body_in_air(state, environment_, Vector3d(Vector3d::Zero()));
      Loads own = of_ground;
      own.force_body_n += in_air.ecef_from_body.transpose() * (axes() * force_ned_n);
      return body_derivative(mass, state, in_air, own);
    };
    const auto fly = [](const auto& f, double from_s, double end_s, BodyVector& at) -> Result<void> {
      at = rk4_step(f, from_s, at, end_s - from_s);
      return {};
    };
    const double now_s = time_s;
    time_s = ++steps_ * dt_s;
    return ground.advance(motion, fly, now_s, time_s, command, x, contact, work).value();
  }

 private:
  static Eigen::Matrix3d axes() { return geodesy::ecef_from_ned(origin).rotation.toRotationMatrix(); }
  Environment environment_;
  std::int64_t steps_ = 0;

 public:
  MassProperties mass = MassProperties::create(11, {.jxx_kgm2 = 0.8, .jyy_kgm2 = 1.1, .jzz_kgm2 = 1.7}).value();
  GroundContact<BodyVector> ground;
  Vector3d force_ned_n = Vector3d::Zero();
  GearCommand command;
  ContactState contact;
  ContactWork work;
  BodyVector x;
  double time_s = 0;
};

std::vector<ContactPoint> pin(double stiffness_npm, double damping_spm) {
  return {{.name = "pin", .body_m = {0, 0, 0.3}, .stiffness_npm = stiffness_npm, .damping_spm = damping_spm}};
}

/// Four points around the centre of mass, in its height: friction turns nothing.
std::vector<ContactPoint> four(ContactPoint like) {
  std::vector<ContactPoint> points;
  for (const double forward : {-0.5, 0.5})
    for (const double right : {-0.5, 0.5}) {
      like.body_m = {forward, right, 0};
      points.push_back(like);
    }
  return points;
}

TEST(Contact, ADropReboundsAsThePhasePortraitHasIt) {
  // Without gravity the speed that is left has a closed form.
  for (const double k : {1e3, 1e4, 1e5, 1e6, 1e7})
    for (const double v : {0.1, 1.0, 3.0})
      for (const double c : {0.0, 0.2, 1.0}) {
        Sled sled(pin(k, c), 0);
        sled.place({0, 0, -0.301}, {0, 0, v});
        for (int i = 0; i < 400 && sled.velocity_ned().z() >= -1e-9; ++i) sled.step();
        for (int i = 0; i < 100; ++i) sled.step();
        EXPECT_NEAR(-sled.velocity_ned().z() / v, restitution(c, v), 2e-4) << k << ' ' << v << ' ' << c;
      }
}

TEST(Contact, RestitutionHasItsLimits) {
  EXPECT_DOUBLE_EQ(restitution(0, 3), 1);
  EXPECT_NEAR(restitution(1, 0.01), 1 - 2.0 / 3 * 0.01, 1e-4);
  EXPECT_NEAR(restitution(100, 10), 1e-3, 1e-5);  // what leaves is never faster than 1 / c
}

TEST(Contact, DampingNeverPullsAndBeginsWithNothing) {
  const ContactPoint point = pin(1e6, 2)[0];
  ContactMotion motion{.depth_m = 0.01,
                       .velocity_mps = {0, 0, 5},
                       .normal = Vector3d::UnitZ(),
                       .forward = Vector3d::UnitX(),
                       .up = Vector3d::UnitZ()};
  EXPECT_EQ(contact_force(point, motion, {}).normal_n, 0);
  motion.velocity_mps.z() = -100;
  motion.depth_m = 1e-12;
  EXPECT_LT(contact_force(point, motion, {}).normal_n, 1e-3);
}

TEST(Contact, ABounceNeverGainsEnergy) {
  for (const double k : {1e4, 1e6}) {
    Sled sled({{.name = "pin", .stiffness_npm = k}});  // in the centre of mass, so that nothing tips over
    sled.place({0, 0, -1}, {0, 0, 0});
    const double start_j = sled.energy_j();
    double most_j = start_j;
    int bounces = 0;
    for (int i = 0; i < 4000; ++i) {
      bounces += sled.step().met != 0;
      if (sled.contact.touching == 0) most_j = std::max(most_j, sled.energy_j());
    }
    EXPECT_GE(bounces, 8) << k;
    // Undamped: within what the tolerance allows, 1e-6 of the speed each bounce
    EXPECT_LT(most_j - start_j, 1e-4 * 11 * g) << k;
    if (sled.contact.touching == 0) {
      EXPECT_GT(sled.energy_j() - start_j, -1e-3 * 11 * g) << k;
    }
  }
}

TEST(Contact, ItComesToRestWhereSpringsCarryTheWeight) {
  for (const double k : {1e3, 1e4, 1e6}) {
    Sled sled(four({.name = "skid", .stiffness_npm = k, .damping_spm = 2}));
    sled.place({0, 0, 0}, {0, 0, 0});
    for (int i = 0; i < 8000 && !sled.contact.resting; ++i) sled.step();
    ASSERT_TRUE(sled.contact.resting) << k;
    EXPECT_NEAR(sled.position_ned().z(), 11 * g / (4 * k), 0.02 * 11 / (4 * k) + 1e-8) << k;  // of woken_mps2
  }
}

TEST(Contact, ASlideStopsWhereFrictionSays) {
  for (const double speed : {1.0, 10.0, 30.0})
    for (const double mu : {0.2, 0.8}) {
      Sled sled(four({.name = "skid", .stiffness_npm = 1e5, .damping_spm = 1, .friction = mu}));
      const double down = 11 * g / 4e5;
      sled.place({0, 0, down}, {0.6 * speed, 0.8 * speed, 0});
      int steps = 0;
      while (!sled.contact.resting && steps < 20'000) sled.step(), ++steps;
      const double expected = speed * speed / (2 * mu * g);
      EXPECT_NEAR(sled.position_ned().head<2>().norm(), expected, 1e-4 * expected + 1e-5) << speed << ' ' << mu;
      EXPECT_NEAR(steps * 0.0025, speed / (mu * g), 0.02) << speed << ' ' << mu;
    }
}

TEST(Contact, AWheelRollsFarStopsByItsBrakeAndHoldsSideways) {
  const ContactPoint wheel{.name = "wheel",
                           .kind = Kind::Wheel,
                           .stiffness_npm = 1e5,
                           .damping_spm = 1,
                           .friction = 0.8,
                           .rolling_friction = 0.02,
                           .brake_friction = 0.48};
  const double down = 11 * g / 4e5;
  const auto distance = [&](const Vector3d& velocity, double brake) {
    Sled sled(four(wheel));
    sled.command.brake = brake;
    sled.place({0, 0, down}, velocity);
    for (int i = 0; i < 20'000 && !sled.contact.resting; ++i) sled.step();
    return sled.position_ned().head<2>().norm();
  };
  EXPECT_NEAR(distance({5, 0, 0}, 0), 25 / (2 * 0.02 * g), 0.01);
  EXPECT_NEAR(distance({5, 0, 0}, 1), 25 / (2 * 0.5 * g), 0.001);
  EXPECT_NEAR(distance({0, 5, 0}, 0), 25 / (2 * 0.8 * g), 0.001);
}

TEST(Contact, WhatStandsNeitherCreepsNorShakesForAnHour) {
  Sled sled(four({.name = "skid", .stiffness_npm = 1e6, .damping_spm = 1, .friction = 0.5}));
  sled.place({0, 0, 0}, {0, 0, 0});
  sled.force_ned_n = {0.4 * 11 * g, 0, 0};  // 0.8 of what holds it
  for (int i = 0; i < 4000; ++i) sled.step();
  const Vector3d settled = sled.position_ned();
  EXPECT_LT(settled.head<2>().norm(), 5e-3);
  for (int i = 0; i < 3600 * 400; ++i) sled.step();
  EXPECT_EQ(sled.position_ned(), settled);
  EXPECT_EQ(sled.velocity_ned(), Vector3d(0, 0, 0));
  sled.force_ned_n = {0.6 * 11 * g, 0, 0};
  for (int i = 0; i < 400; ++i) sled.step();
  EXPECT_NEAR(sled.velocity_ned().x(), 0.1 * g, 0.01) << "more than friction holds moves it";
}

TEST(Contact, UnderLoadsThatChangeItCreepsNoFasterThanSaid) {
  Sled sled(four({.name = "skid", .stiffness_npm = 1e5, .damping_spm = 1, .friction = 0.5}));
  sled.place({0, 0, 11 * g / 4e5}, {0, 0, 0});
  const int steps = 60 * 400;
  for (int i = 0; i < steps; ++i) {
    sled.force_ned_n = {(0.2 + 0.05 * std::sin(0.1 * i)) * 11 * g, 0, 0};
    sled.step();
  }
  EXPECT_GT(sled.position_ned().x(), 0);
  EXPECT_LT(sled.position_ned().x(), 0.5 * friction_speed_mps * steps * 0.0025 * 1.01);
}

TEST(Contact, TheOnsetIsFoundWithinATolerance) {
  // Falls 0.1 m: when it meets the ground is known, and what a stiff spring makes of an error shows in the rebound's
  // time.
  for (const double dt_s : {0.0025, 0.01, 0.02}) {
    Sled sled(pin(1e6, 0));
    sled.place({0, 0, -0.4}, {0, 0, 0});
    const double fall_s = std::sqrt(0.2 / g), speed = g * fall_s;
    // Half a swing of the spring about where it carries the weight, longer at both ends
    const double w = std::sqrt(1e6 / 11), there = g / (w * w);
    const double contact_s = (std::numbers::pi + 2 * std::atan(there * w / speed)) / w;
    while (sled.time_s < 0.25) sled.step(dt_s);
    const double after_s = sled.time_s - fall_s - contact_s;
    EXPECT_NEAR(sled.velocity_ned().z(), -speed + g * after_s, 1e-4) << dt_s;
    EXPECT_NEAR(sled.position_ned().z(), -0.3 - speed * after_s + g * after_s * after_s / 2, 2e-5) << dt_s;
  }
}

TEST(Contact, FarFromTheGroundNothingIsPaid) {
  Sled sled(four({.name = "skid", .stiffness_npm = 1e6, .damping_spm = 1}), 0);
  sled.place({0, 0, -1000}, {25, 0, 0});
  for (int i = 0; i < 4000; ++i) sled.step();
  const ContactWork& work = sled.work;
  EXPECT_EQ(work.clear_steps, 4000);
  EXPECT_EQ(work.looks, 1);
  EXPECT_EQ(work.low_steps + work.contact_steps + work.contact.evaluations, 0);

  // Low but clear: the ground is looked at, and nothing is integrated with it
  sled.place({0, 0, -0.6}, {25, 0, 0});
  for (int i = 0; i < 400; ++i) sled.step();
  EXPECT_EQ(work.low_steps, 400);
  EXPECT_EQ(work.contact_steps + work.contact.evaluations, 0);
}

TEST(Contact, WhatTheGroundCostsIsCounted) {
  // A drop of 0.3 m that bounces and settles, a slide, and standing: evaluations a step of 2.5 ms.
  for (const double k : {1e3, 1e4, 1e5, 1e6, 1e7}) {
    Sled drop(pin(k, 0.5));
    drop.place({0, 0, -0.6}, {0, 0, 0});
    for (int i = 0; i < 400; ++i) drop.step();
    Sled slide(four({.name = "skid", .stiffness_npm = k, .damping_spm = 2, .friction = 0.5}));
    slide.place({0, 0, 11 * g / (4 * k)}, {10, 0, 0});
    for (int i = 0; i < 400; ++i) slide.step();
    const auto each = [](const Sled& sled) {
      return static_cast<double>(sled.work.contact.evaluations) / static_cast<double>(sled.work.contact_steps);
    };
    RecordProperty(fmt::format("drop_evaluations_{:g}", k), fmt::format("{:.1f}", each(drop)));
    RecordProperty(fmt::format("drop_steps_{:g}", k),
                   fmt::format("{:.2f}", static_cast<double>(drop.work.contact.steps) /
                                             static_cast<double>(drop.work.contact_steps)));
    RecordProperty(fmt::format("slide_evaluations_{:g}", k), fmt::format("{:.1f}", each(slide)));
    EXPECT_LT(each(slide), 50) << k;  // an explicit method takes the more the stiffer friction is: 4e4 /s here
    EXPECT_LT(each(drop), 400) << k;
  }
}

TEST(Contact, APartThatMeetsTheGroundIsACrashWithItsTime) {
  auto points = pin(1e5, 1);
  points.push_back({.name = "nose", .kind = Kind::Part, .body_m = {0, 0, 0.4}});
  Sled sled(points);
  sled.place({0, 0, -0.5}, {0, 0, 2});
  ContactReport report;
  while (!report.part && sled.time_s < 1) report = sled.step();
  ASSERT_TRUE(report.part);
  EXPECT_EQ(report.part->point, 1);
  EXPECT_NEAR(report.part->time_s, (std::sqrt(4 + 2 * g * 0.1) - 2) / g, 1e-5);
}

TEST(Contact, GearThatCannotBeIsRefusedWithAllThatIsWrong) {
  const auto refused = ContactGear::create(
      {{.name = "left", .stiffness_npm = -1, .damping_spm = 2},
       {.name = "right", .kind = Kind::Wheel, .stiffness_npm = 1e4, .friction = 0.3, .brake_friction = 0.6}});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("left: stiffness"), std::string::npos);
  EXPECT_NE(refused.error().message.find("right: brake_friction: expected"), std::string::npos);
}

}  // namespace
}  // namespace nadir::sim
