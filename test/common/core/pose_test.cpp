// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/pose.h"

#include "common/core/random.h"
#include "test/catch.h"

using namespace berth;

namespace {

Pose random_pose(Random& random) { return {random.normal_vector(3.0), random.rotation()}; }

}  // namespace

TEST_CASE("the paper's pose in x y z w p r is the rotation matrix Rz(r) Ry(p) Rx(w)") {
  const Pose pose = pose_from_xyzwpr({100, -230, 8000, 25, 20, -30});
  Matrix3d expected;
  expected << 0.813798, 0.578333, 0.057138, -0.469846, 0.712614, -0.520986, -0.342020, 0.397131,
      0.851651;
  CHECK((pose.rotation.toRotationMatrix() - expected).cwiseAbs().maxCoeff() < 1e-6);
  CHECK((pose.position - Vector3d(0.1, -0.23, 8.0)).norm() < 1e-15);
}

TEST_CASE("x y z w p r goes round for any attitude, also at p = 90 degrees") {
  Random random(1, "pose");
  for (int i = 0; i < 1000; ++i) {
    const Pose pose = random_pose(random);
    const Pose back = pose_from_xyzwpr(xyzwpr_from_pose(pose));
    CHECK(difference(pose, back).norm() < 1e-12);
  }
  for (const double p : {90.0, -90.0}) {
    const Pose pose = pose_from_xyzwpr({1, 2, 3, 20, p, 50});
    const auto shown = xyzwpr_from_pose(pose);
    CHECK(shown[3] == 0);
    CHECK(angle_between(pose, pose_from_xyzwpr(shown)) < 1e-7);
  }
}

TEST_CASE("difference undoes perturbed, up to half a turn") {
  Random random(2, "pose");
  for (int i = 0; i < 1000; ++i) {
    const Pose pose = random_pose(random);
    Vector6d d;
    d << random.normal_vector(1.0), random.normal_vector(0.8);
    if (d.tail<3>().norm() > 3.1) continue;
    CHECK((difference(pose, perturbed(pose, d)) - d).norm() < 1e-12);
  }
}

TEST_CASE("poses compose and invert as transformations of points do") {
  Random random(3, "pose");
  for (int i = 0; i < 200; ++i) {
    const Pose a = random_pose(random);
    const Pose b = random_pose(random);
    const Vector3d p = random.normal_vector(2.0);
    CHECK(((a * b) * p - a * (b * p)).norm() < 1e-12);
    CHECK((a.inverse() * (a * p) - p).norm() < 1e-12);
    CHECK((a.isometry() * p - a * p).norm() < 1e-12);
  }
}

TEST_CASE("interpolation ends where it should and turns at constant rate") {
  Random random(4, "pose");
  for (int i = 0; i < 200; ++i) {
    const Pose a = random_pose(random);
    const Pose b = random_pose(random);
    CHECK(difference(a, interpolate(a, b, 0)).norm() < 1e-12);
    CHECK(difference(b, interpolate(a, b, 1)).norm() < 1e-9);
    CHECK(angle_between(a, interpolate(a, b, 0.25)) == Approx(0.25 * angle_between(a, b)));
    const Velocity v = velocity_between(a, b, 2.0);
    CHECK(difference(b, moved(a, v, 2.0)).norm() < 1e-9);
  }
}

TEST_CASE("random streams repeat by seed and name and differ between names") {
  Random a(7, "lidar");
  Random b(7, "lidar");
  Random c(7, "arm");
  double sum = 0;
  double squares = 0;
  for (int i = 0; i < 20000; ++i) {
    const double x = a.normal();
    CHECK(x == b.normal());
    CHECK(x != c.normal());
    sum += x;
    squares += x * x;
  }
  CHECK(std::abs(sum / 20000) < 0.03);
  CHECK(squares / 20000 == Approx(1.0).margin(0.04));
}
