// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/model/symmetry.h"

#include <cmath>

#include "test/catch.h"
#include "test/estimator/scan_maker.h"

using namespace berth;
using namespace berth::estimator;

namespace {

std::shared_ptr<const TargetModel> model_of(const Mesh& mesh) {
  Target target;
  target.name = "test";
  target.mesh = mesh;
  target.hash = content_hash(mesh);
  target.length = bounding_box(mesh).size().maxCoeff();
  ModelOptions coarse;
  coarse.surface_samples = 4000;
  coarse.grid_voxels = 40000;
  coarse.views = 20;
  return compile_target_model(target, coarse);
}

Pose turn(const Vector3d& axis, double angle) {
  return {Vector3d::Zero(), rotation_from_vector(radians(angle) * axis)};
}

}  // namespace

TEST_CASE("A cube has 24 equal poses, a box four, a bar of square section eight") {
  CHECK(model_of(make_box({1, 1, 1}))->symmetries.exact_count() == 24);
  CHECK(model_of(make_box({2, 1, 0.7}))->symmetries.exact_count() == 4);
  CHECK(model_of(make_box({2, 0.6, 0.6}))->symmetries.exact_count() == 8);
}

TEST_CASE("The replica has no symmetry, but poses that look nearly like it") {
  const Symmetries& symmetries = replica_model()->symmetries;
  CHECK(symmetries.exact_count() == 1);
  CHECK_FALSE(symmetries.revolution);
  // the half turn about the vertical axis, which only small features distinguish
  REQUIRE_FALSE(symmetries.motions.empty());
  const Quaterniond nearest = symmetries.motions.front().motion.rotation;
  CHECK(nearest.angularDistance(turn(Vector3d::UnitY(), 180).rotation) < radians(10));
  CHECK(symmetries.motions.front().deviation_m > 0.01);
}

TEST_CASE("A cylinder may be turned about its axis by any angle, and upside down") {
  const auto model = model_of(make_cylinder(0.3, 2, 64));
  const Symmetries& symmetries = model->symmetries;
  REQUIRE(symmetries.revolution);
  CHECK(std::abs(symmetries.axis.z()) > 0.9999);
  CHECK(symmetries.exact_count() == 2);
  const Pose pose{{0, 0, 5}, rotation_from_vector({0.3, 0.8, -0.4})};
  const Pose same = pose * turn(Vector3d::UnitX(), 180) * turn(Vector3d::UnitZ(), 77);
  CHECK(symmetries.angle_between(same, pose) < radians(0.1));
  CHECK(symmetries.distance(same, pose) < 0.001);
  const Pose tilted = pose * turn(Vector3d::UnitX(), 10) * turn(Vector3d::UnitZ(), 77);
  CHECK(symmetries.angle_between(tilted, pose) == Approx(radians(10)).margin(radians(0.1)));
}

TEST_CASE("A small thing on one face of a cube breaks its symmetry") {
  Mesh mesh = make_box({1, 1, 1});
  mesh.append(make_box({0.3, 0.15, 0.1}), {{0.2, 0.1, 0.55}, Quaterniond::Identity()});
  const auto model = model_of(mesh);
  const Symmetries& symmetries = model->symmetries;
  CHECK(symmetries.exact_count() == 1);
  // 23 ways to be confused
  CHECK(symmetries.motions.size() >= 23);
}

TEST_CASE("Of equal poses the one nearest to another is found") {
  const Symmetries& symmetries = cube_model()->symmetries;
  const Pose pose{{0.1, 0.2, 4}, rotation_from_vector({0.1, 0.2, 0.3})};
  const Pose turned = pose * turn(Vector3d(1, 1, 1).normalized(), 120);
  const Pose back = symmetries.nearest_equal(turned, pose);
  CHECK(angle_between(back, pose) < radians(0.2));
  CHECK(distance(back, pose) < 0.002);
  CHECK(symmetries.angle_between(pose * turn(Vector3d::UnitZ(), 100), pose) ==
        Approx(radians(10)).margin(radians(0.2)));
}
