#include "nadir/sim/mixer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include "vehicle/models.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;

constexpr double density = 1.225;

Mixer mixer_of(const Multirotor& vehicle) { return Mixer::create(vehicle, density).value(); }

/// What rotors do with thrusts, by their geometry.
RotorDemand done_by(const Multirotor& vehicle, const RotorValues& thrust_n) {
  RotorDemand done;
  for (Eigen::Index i = 0; i < thrust_n.size(); ++i) {
    const Rotor& rotor = vehicle.rotors[static_cast<std::size_t>(i)];
    const auto& m = std::get<ElectricDrive>(rotor.drive).propulsion;
    const Vector3d force = thrust_n[i] * rotor.thrust_axis;
    done.thrust_n -= force.z();
    done.moment_nm += rotor.position_m.cross(force) +
                      (rotor.clockwise ? 1 : -1) * thrust_n[i] * m.cq0 * m.diameter_m / m.ct0 * rotor.thrust_axis;
  }
  return done;
}

/// `count` rotors around a circle.
Multirotor ring(int count) {
  Multirotor vehicle = quadrotor();
  const Rotor like = vehicle.rotors[0];
  vehicle.rotors.clear();
  for (int i = 0; i < count; ++i) {
    Rotor rotor = like;
    const double angle = 2 * std::numbers::pi * (i + 0.5) / count;
    rotor.position_m = 0.3 * Vector3d(std::cos(angle), std::sin(angle), 0);
    rotor.clockwise = i % 2 == 1;
    vehicle.rotors.push_back(rotor);
  }
  return vehicle;
}

TEST(Mixer, GivesWhatIsAskedWhereItFits) {
  for (const int count : {4, 6, 8, 12, 16}) {
    const Multirotor vehicle = ring(count);
    const RotorDemand demand{0.4 * count * 35.9, {0.7, -0.5, 0.1}};
    const auto mix = mixer_of(vehicle).mix(demand);
    const RotorDemand done = done_by(vehicle, mix.thrust_n);
    EXPECT_FALSE(mix.saturated);
    EXPECT_NEAR(done.thrust_n, demand.thrust_n, 1e-9);
    EXPECT_NEAR((done.moment_nm - demand.moment_nm).norm(), 0, 1e-9);
  }
}

TEST(Mixer, SignsOfAQuadInX) {
  const Mixer mixer = mixer_of(quadrotor());
  const auto change = [&](const Vector3d& moment) {
    return RotorValues(mixer.mix({34, moment}).thrust_n - mixer.mix({34, Vector3d::Zero()}).thrust_n);
  };
  // Front right, rear right, rear left, front left
  const RotorValues roll = change({0.5, 0, 0}), pitch = change({0, 0.5, 0}), yaw = change({0, 0, 0.05});
  EXPECT_TRUE(roll[0] < 0 && roll[1] < 0 && roll[2] > 0 && roll[3] > 0);
  EXPECT_TRUE(pitch[0] > 0 && pitch[1] < 0 && pitch[2] < 0 && pitch[3] > 0);
  EXPECT_TRUE(yaw[0] > 0 && yaw[1] < 0 && yaw[2] > 0 && yaw[3] < 0);
}

/// Whatever is asked: rotors within their limits; roll and pitch in the direction asked for, and whole wherever any
/// thrust allows that; yaw of the sign asked for and never more.
TEST(Mixer, AttitudeComesBeforeThrustAndThrustBeforeYaw) {
  const Multirotor vehicle = quadrotor();
  const Mixer mixer = mixer_of(vehicle);
  const double most = 35.94, arm = 0.25 / std::sqrt(2.0);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> thrust(-50, 200), moment(-15, 15), yaw(-2, 2);
  int saturated = 0, scaled = 0;
  for (int i = 0; i < 2000; ++i) {
    const RotorDemand demand{thrust(random), {moment(random), moment(random), yaw(random)}};
    const auto mix = mixer.mix(demand);
    EXPECT_GE(mix.thrust_n.minCoeff(), 0);
    EXPECT_LE(mix.thrust_n.maxCoeff(), most + 0.01);
    const RotorDemand done = done_by(vehicle, mix.thrust_n);
    EXPECT_NEAR(done.thrust_n, mix.given.thrust_n, 1e-9);
    EXPECT_NEAR((done.moment_nm - mix.given.moment_nm).norm(), 0, 1e-9);
    const double share = mix.given.moment_nm.x() / demand.moment_nm.x();
    EXPECT_NEAR(mix.given.moment_nm.y(), share * demand.moment_nm.y(), 1e-9);
    // Rotors of this quad differ by (|l| + |m|) / (2 arm) at most: as much as one has.
    const double spread = (std::abs(demand.moment_nm.x()) + std::abs(demand.moment_nm.y())) / (2 * arm);
    EXPECT_NEAR(share, std::min(1.0, most / spread), 1e-3);
    EXPECT_GE(mix.given.moment_nm.z() * demand.moment_nm.z(), 0);
    EXPECT_LE(std::abs(mix.given.moment_nm.z()), std::abs(demand.moment_nm.z()) + 1e-9);
    saturated += mix.saturated;
    scaled += share < 1;
  }
  EXPECT_GT(saturated, 1000) << "the draws no longer exercise the limits";
  EXPECT_GT(scaled, 200);
}

TEST(Mixer, ControlsAreThoseOfTheThrusts) {
  for (const Multirotor& vehicle : {quadrotor(), pulsed_quadrotor()}) {
    const Mixer mixer = mixer_of(vehicle);
    const auto mix = mixer.mix({20, {0.2, -0.1, 0.01}});
    const MultirotorControls controls = mixer.controls_for(mix.thrust_n, {}, 0, 0);
    for (int i = 0; i < 4; ++i)
      EXPECT_NEAR(
          settled_output(vehicle.rotors[static_cast<std::size_t>(i)], controls.actuators[i], 0, density).thrust_n,
          mix.thrust_n[i], 1e-9);
  }
}

TEST(Mixer, ALeadBringsALaggingThrustThereInTime) {
  const Multirotor vehicle = pulsed_quadrotor();
  const Mixer mixer = mixer_of(vehicle);
  MultirotorState state;
  state.followed = RotorValues::Constant(4, 4.9);
  state.followed_torque_nm = RotorValues::Constant(4, 0.08);
  RotorValues wanted(4);
  wanted << 5.2, 4.6, 5.0, 4.8;
  follow_for(vehicle, mixer.controls_for(wanted, state.followed, 0.05, 0), 0.05, state);
  EXPECT_NEAR((state.followed - wanted).abs().maxCoeff(), 0, 1e-9);
}

TEST(Mixer, SaysWhatRotorsCannot) {
  const auto message = [](const Multirotor& vehicle) {
    const auto mixer = Mixer::create(vehicle, density);
    return mixer ? std::string() : mixer.error().message;
  };
  EXPECT_NE(message(ring(3)).find("fewer than four"), std::string::npos);
  Multirotor same_way = ring(4), on_a_line = ring(4), beside = ring(4), against = ring(4);
  for (Rotor& rotor : same_way.rotors) rotor.clockwise = true;
  EXPECT_NE(message(same_way).find("same way"), std::string::npos);
  for (Rotor& rotor : on_a_line.rotors) rotor.position_m.y() = 0;
  EXPECT_NE(message(on_a_line).find("one line"), std::string::npos);
  for (Rotor& rotor : beside.rotors) rotor.position_m.x() += 1;
  EXPECT_NE(message(beside).find("centre of mass"), std::string::npos);
  for (std::size_t i = 0; i < 2; ++i) against.rotors[i].thrust_axis *= -1;
  EXPECT_NE(message(against).find("cancel"), std::string::npos);
}

}  // namespace
}  // namespace nadir::sim
