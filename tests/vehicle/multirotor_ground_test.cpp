#include "nadir/sim/multirotor_ground.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nadir/sim/step.h"
#include "vehicle/models.h"
#include "vehicle/slope.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;
using geodesy::Geodetic;
using Kind = ContactPoint::Kind;

const Geodetic origin = Geodetic::degrees(38.1, -0.76, 0);
const geodesy::LocalFrame frame(origin);
constexpr double g = 9.81;

/// The same gear with every skid changed.
template <class Change>
ContactGear with_skids(const ContactGear& gear, const Change& change) {
  std::vector<ContactPoint> points = gear.points();
  for (ContactPoint& point : points)
    if (point.kind == Kind::Skid) change(point);
  return ContactGear::create(std::move(points)).value();
}

Multirotor with_motors_and_battery() {
  Multirotor vehicle = quadrotor();
  for (Rotor& rotor : vehicle.rotors) std::get<ElectricDrive>(rotor.drive).dynamics = {.rotor_inertia_kgm2 = 2e-4};
  vehicle.battery = lithium_polymer(6, 10, 0.02);
  return vehicle;
}

/// 3.5 kg that nothing but gravity and the ground acts on.
Multirotor inert() {
  Multirotor vehicle = quadrotor();
  vehicle.drag = {};
  vehicle.ground_effect = {};
  for (Rotor& rotor : vehicle.rotors) {
    rotor.drive = PulseDrive{.thrust_n = {0, 0.01, -10}, .torque_nm = {}, .max_thrust_n = 10, .radius_m = 0.19};
    rotor.rise_time_constant_s = rotor.fall_time_constant_s = 0;
  }
  return vehicle;
}

/// A multirotor with its rotors off, on the ground or over it. `Vector`: as it is integrated.
template <class Vector>
class Parked {
 public:
  Parked(const Multirotor& of, const Environment& environment,
         std::shared_ptr<const Ground> on = std::make_shared<PlaneGround>(frame, 0))
      : vehicle(of), environment_(environment), ground_(std::move(on)) {
    const bool lags = vehicle.lumped || vehicle.rotors[0].rise_time_constant_s > 0;
    const auto rotors = static_cast<Eigen::Index>(vehicle.lumped ? 4 : vehicle.rotors.size());
    controls_.actuators = RotorValues::Zero(rotors);
    if (lags) state.followed = state.followed_torque_nm = RotorValues::Zero(rotors);
    if (Vector::RowsAtCompileTime != 13) state.omega_radps = RotorValues::Zero(rotors), state.charge_ah = 10;
    static_cast<BodyState&>(state) = standing_body(environment_, gear_of(vehicle), *ground_, origin, 0);
    contact_.emplace(ground_for(vehicle, ground_, environment_, vector()));
  }

  ContactReport step(double dt_s = 0.0025) {
    const AirOverTime air(wind);
    const MultirotorMotion motion(vehicle, environment_, state, controls_, air, time_s, CurrentModel::Settled);
    const auto fly = [](const auto& f, double from_s, double end_s, Vector& at) -> Result<void> {
      at = rk4_step(f, from_s, at, end_s - from_s);
      renormalise_quaternion(at, body_quaternion_at);
      return {};
    };
    Vector x = vector();
    const double end_s = ++steps_ * dt_s;
    const auto report =
        contact_->advance(over_ground<Vector>(motion), fly, time_s, end_s, {}, x, contact, work).value();
    state = motion.state_at(end_s, x);
    time_s = end_s;
    return report;
  }
  void settle() {
    for (int i = 0; i < 8000 && !contact.resting; ++i) step();
    EXPECT_TRUE(contact.resting);
  }
  void raise(double up_m) { state.position.xyz += up_m * ground_->under(state.position).normal_ecef; }
  double height_m() const { return ground_->under(state.position).height_m; }
  double sink_mps() const { return -state.velocity.xyz.dot(ground_->under(state.position).normal_ecef); }
  Vector3d enu_m() const { return (frame.enu_from_ecef() * state.position).xyz; }
  void move_ned(const Vector3d& mps) { state.velocity.xyz = geodesy::ecef_from_ned(origin).rotation * mps; }
  const std::string& name(int point) const { return contact_->gear().points()[static_cast<std::size_t>(point)].name; }

  Multirotor vehicle;
  MultirotorState state;
  ContactState contact;
  ContactWork work;
  Vector3d wind = Vector3d::Zero();
  double time_s = 0;

 private:
  Vector vector() const {
    if constexpr (Vector::RowsAtCompileTime == 13)
      return to_vector(static_cast<const BodyState&>(state));
    else
      return to_vector(vehicle, state, CurrentModel::Settled);
  }
  Environment environment_;
  std::shared_ptr<const Ground> ground_;
  std::optional<GroundContact<Vector>> contact_;
  MultirotorControls controls_;
  std::int64_t steps_ = 0;
};
using Plain = Parked<BodyVector>;

const Environment flat = Environment::flat(origin, g);

TEST(MultirotorGround, LegsFollowFromTheRotors) {
  for (const Multirotor& vehicle : {quadrotor(), pulsed_quadrotor(), lumped_multirotor()}) {
    const ContactGear gear = gear_of(vehicle);
    double stiffness_npm = 0;
    Vector3d sum = Vector3d::Zero();
    for (const ContactPoint& point : gear.points()) {
      if (point.kind == Kind::Part) {
        EXPECT_LT(point.body_m.z(), 0.5 * standing_height_m(gear)) << point.name;
        continue;
      }
      stiffness_npm += point.stiffness_npm;
      sum += point.body_m;
    }
    EXPECT_NEAR(vehicle.mass.mass_kg() * 9.80665 / stiffness_npm, 0.004, 1e-12);
    EXPECT_NEAR(sum.head<2>().norm(), 0, 1e-12) << "it stands upright";
  }
  EXPECT_NEAR(standing_height_m(gear_of(quadrotor())), 0.15, 1e-12);
  // Two rotors in one line stand too, and sixteen have points enough
  Multirotor odd = quadrotor();
  odd.rotors.resize(2);
  odd.rotors[0].position_m = {0, 0.3, 0};
  odd.rotors[1].position_m = {0, -0.3, 0};
  EXPECT_GT(gear_of(odd).points()[0].body_m.x(), 0.05);
  odd.rotors.resize(16, odd.rotors[0]);
  EXPECT_EQ(gear_of(odd).points().size(), 22u);
  odd.gear = ContactGear();
  EXPECT_EQ(gear_of(odd).points().size(), 1u) << "its own";
}

template <class Vector>
void stands(const Multirotor& vehicle, const Environment& environment, std::shared_ptr<const Ground> on, int seconds) {
  Parked<Vector> parked(vehicle, environment, std::move(on));
  parked.wind = {-3, 2, 0};
  const double legs_m = parked.height_m();
  parked.settle();
  ASSERT_TRUE(parked.contact.resting);
  EXPECT_EQ(parked.contact.touching, 0b1111u);
  // m g / k, within what it may still be accelerated by when it comes to rest
  EXPECT_NEAR(parked.height_m(), legs_m - 0.004 * g / 9.80665, 0.004 * 0.02 / g + 2e-5);
  const Eigen::Matrix<double, 13, 1> settled = to_vector(static_cast<const BodyState&>(parked.state));
  for (int i = 0; i < seconds * 100; ++i) parked.step(0.01);
  EXPECT_EQ(to_vector(static_cast<const BodyState&>(parked.state)), settled);
  EXPECT_TRUE(parked.contact.resting);
}

TEST(MultirotorGround, ItStandsForAnHourWhereSpringsCarryTheWeight) {
  const auto plane = std::make_shared<PlaneGround>(frame, 0);
  for (const Multirotor& vehicle : {quadrotor(), pulsed_quadrotor(), lumped_multirotor()})
    stands<BodyVector>(vehicle, flat, plane, 3600);
  stands<MultirotorVector>(with_motors_and_battery(), flat, plane, 120);
  stands<BodyVector>(quadrotor(), Environment::wgs84(), std::make_shared<EllipsoidGround>(0), 3600);
}

TEST(MultirotorGround, ATouchDownReboundsAsThePhasePortraitHasIt) {
  for (const double v : {0.3, 1.0, 2.0}) {
    Plain parked(inert(), Environment::flat(origin, 0));
    parked.raise(0.001);
    parked.move_ned({0, 0, v});
    ContactReport report;
    double most_n = 0;
    for (int i = 0; i < 200; ++i) {
      report = parked.step();
      most_n = std::max(most_n, report.most_n);
      ASSERT_FALSE(report.broken) << v;
    }
    EXPECT_NEAR(-parked.sink_mps() / v, restitution(gear_of(parked.vehicle).points()[0].damping_spm, v), 5e-4) << v;
    if (v == 1) {
      EXPECT_NEAR(4 * most_n, 6 * 3.5 * g, 0.5 * 3.5 * g);
    }
  }
}

TEST(MultirotorGround, AHardTouchDownBreaksALegThatIsNamed) {
  const auto broken = [](double mps) {
    Plain parked(inert(), flat);
    parked.raise(0.001);
    parked.move_ned({0, 0, mps});
    for (int i = 0; i < 100; ++i)
      if (const auto report = parked.step(); report.broken) return parked.name(report.broken->point);
    return std::string("none");
  };
  EXPECT_EQ(broken(1), "none");
  EXPECT_EQ(broken(2.8), "none");
  EXPECT_NE(broken(3.3).find(" skid"), std::string::npos);
}

TEST(MultirotorGround, AFallFrom30MetresMeetsTheGroundWhenItShould) {
  Plain parked(inert(), flat);
  parked.raise(30);
  ContactReport report;
  while (!report.broken && !report.part && parked.time_s < 5) report = parked.step(0.01);
  ASSERT_TRUE(report.broken);
  EXPECT_NEAR(report.broken->time_s, std::sqrt(2 * 30 / g), 1e-3) << "with what the spring gives before it breaks";
  EXPECT_NEAR(report.impact_mps, std::sqrt(2 * 30 * g), 0.1);
}

TEST(MultirotorGround, ABounceNeverGainsEnergy) {
  Multirotor vehicle = inert();
  vehicle.gear = with_skids(gear_of(vehicle), [](ContactPoint& p) { p.damping_spm = 0, p.friction = 0; });
  Plain parked(vehicle, flat);
  parked.raise(0.2);
  const auto energy_j = [&] {
    return 3.5 * (0.5 * parked.state.velocity.xyz.squaredNorm() + g * parked.height_m()) +
           0.5 * parked.state.body_rates_radps.dot(vehicle.mass.inertia_kgm2() * parked.state.body_rates_radps);
  };
  const double start_j = energy_j(), drop_j = 3.5 * g * 0.2;
  int bounces = 0;
  for (int i = 0; i < 2000; ++i) {
    bounces += parked.step().met != 0;
    if (parked.contact.touching == 0) {
      ASSERT_NEAR(energy_j(), start_j, 1e-3 * drop_j) << i;
    }
  }
  EXPECT_GE(bounces, 8);
}

TEST(MultirotorGround, DriftAtTouchDownSlidesAsFarAsFrictionSays) {
  for (const double mu : {0.2, 0.4}) {
    Multirotor vehicle = inert();
    vehicle.gear = with_skids(gear_of(vehicle), [&](ContactPoint& p) { p.friction = mu; });
    Plain parked(vehicle, flat);
    parked.settle();
    parked.contact = {};
    const Vector3d from = parked.enu_m();
    parked.move_ned({1.2, 1.6, 0});
    parked.settle();
    // Its four skids carry the weight in the mean: rocking on its springs adds nothing
    const double expected = 4 / (2 * mu * g);
    EXPECT_NEAR((parked.enu_m() - from).head<2>().norm(), expected, 0.01 * expected) << mu;
  }
}

TEST(MultirotorGround, ASlopeThatIsTooSteepTipsItOver) {
  Multirotor vehicle = inert();
  vehicle.gear = with_skids(gear_of(vehicle), [](ContactPoint& p) { p.friction = 5, p.stiffness_npm *= 100; });
  const ContactPoint& skid = vehicle.gear->points()[0];
  const double tips_rad = std::atan(std::abs(skid.body_m.y()) / skid.body_m.z());
  const auto outcome = [&](double slope_rad) {
    Plain parked(vehicle, flat, std::make_shared<SlopeEast>(frame, slope_rad));
    for (int i = 0; i < 4000; ++i)
      if (const auto report = parked.step(); report.part) return parked.name(report.part->point);
    return std::string(parked.contact.resting ? "stands" : "moves");
  };
  EXPECT_EQ(outcome(tips_rad - 0.01), "stands");
  const std::string part = outcome(tips_rad + 0.01);
  EXPECT_TRUE(part == "rotor 1" || part == "rotor 2") << part << ": those on the right, down the slope";
}

TEST(MultirotorGround, ASlopeSteeperThanFrictionIsSlidDown) {
  for (const double off_rad : {-0.02, 0.02}) {
    Multirotor vehicle = inert();
    vehicle.gear = with_skids(gear_of(vehicle), [](ContactPoint& p) { p.friction = 0.4; });
    const double slope_rad = std::atan(0.4) + off_rad;
    Plain parked(vehicle, flat, std::make_shared<SlopeEast>(frame, slope_rad));
    for (int i = 0; i < 800; ++i) parked.step();  // until it rocks no more, which moves its feet to and fro
    const double before_mps = parked.state.velocity.xyz.norm();
    for (int i = 0; i < 400; ++i) parked.step();
    if (off_rad < 0) {
      EXPECT_TRUE(parked.contact.resting);
      EXPECT_EQ(parked.contact.touching, 0b1111u);
    } else {
      const double along = g * (std::sin(slope_rad) - 0.4 * std::cos(slope_rad));
      EXPECT_NEAR(parked.state.velocity.xyz.norm() - before_mps, along, 0.005 * along);
    }
  }
}

TEST(MultirotorGround, AirborneNothingIsPaidForTheGround) {
  Plain parked(quadrotor(), flat);
  parked.raise(1000);
  for (int i = 0; i < 500; ++i) parked.step(0.01);
  EXPECT_EQ(parked.work.clear_steps, 500);
  EXPECT_LE(parked.work.looks, 2);
  EXPECT_EQ(parked.work.low_steps + parked.work.contact_steps + parked.work.contact.evaluations, 0);
}

}  // namespace
}  // namespace nadir::sim
