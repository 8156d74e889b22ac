#include "nadir/sim/rigid_body.h"

#include <gtest/gtest.h>

#include <cmath>

namespace nadir::sim {
namespace {
using Eigen::Vector3d;

std::string fault(double mass_kg, const Inertia& inertia) {
  const auto made = MassProperties::create(mass_kg, inertia);
  return made ? "" : made.error().message;
}

TEST(MassProperties, ABodyThatCannotBeIsRefusedWithAllThatIsWrong) {
  EXPECT_EQ(fault(1, {1, 1, 1}), "");
  EXPECT_EQ(fault(1, {1, 1, 2}), "") << "a flat plate";
  EXPECT_NE(fault(-1, {1, 1, 1}).find("found -1"), std::string::npos);
  EXPECT_NE(fault(1, {1, 1, 2.1}).find("exceeds the sum"), std::string::npos);
  EXPECT_NE(fault(1, {1, 1, 1, 0, 2, 0}).find("positive principal moments"), std::string::npos);
  EXPECT_NE(fault(1, {1, NAN, 1}).find("finite"), std::string::npos);
  EXPECT_NE(fault(INFINITY, {1, 1, 1}).find("mass"), std::string::npos);
  const std::string both = fault(0, {1, 1, -1});
  EXPECT_NE(both.find("mass"), std::string::npos);
  EXPECT_NE(both.find("inertia"), std::string::npos);
}

TEST(MassProperties, AMomentTurnsWithAllProductsOfInertia) {
  // Of three point masses: J = sum m (r^2 I - r r^T), so that J w' + w x J w = M by the definition of angular momentum.
  const Vector3d points[] = {{1, 0.2, -0.3}, {-0.4, 0.9, 0.1}, {0.3, -0.5, 1.1}};
  Eigen::Matrix3d j = Eigen::Matrix3d::Zero();
  for (const Vector3d& r : points) j += 2 * (r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose());
  const MassProperties mass =
      MassProperties::create(6, {j(0, 0), j(1, 1), j(2, 2), -j(0, 1), -j(0, 2), -j(1, 2)}).value();
  EXPECT_LT((mass.inertia_kgm2() - j).norm(), 1e-15);
  const Vector3d w(0.5, -1, 2), moment(1, 2, -3);
  const Vector3d change = mass.angular_acceleration(w, moment);
  Vector3d momentum_change = Vector3d::Zero();  // of points that turn: m r x (w' x r + w x (w x r))
  for (const Vector3d& r : points) momentum_change += 2 * r.cross(change.cross(r) + w.cross(w.cross(r)));
  EXPECT_LT((momentum_change - moment).norm(), 1e-12);
}

}  // namespace
}  // namespace nadir::sim
