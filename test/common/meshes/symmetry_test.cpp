// SPDX-License-Identifier: BSD-3-Clause
#include "common/meshes/symmetry.h"

#include "common/core/error.h"
#include "test/catch.h"

using namespace berth;

namespace {

SymmetryGroup symmetry_of_mesh(const Mesh& mesh) { return find_symmetry(RayCaster(mesh)); }

Pose half_turn_about(const Vector3d& axis) {
  return {Vector3d::Zero(), rotation_from_vector(radians(180) * axis)};
}

}  // namespace

TEST_CASE("a cube lies on itself in 24 ways, a bar of square section in eight, a box in four") {
  CHECK(symmetry_of_mesh(make_box({1, 1, 1})).motions.size() == 23);
  CHECK(symmetry_of_mesh(make_box({2, 0.6, 0.6})).motions.size() == 7);
  const SymmetryGroup box = symmetry_of_mesh(make_box({2, 1, 0.7}));
  CHECK(box.motions.size() == 3);
  CHECK(box.tolerance_m == Approx(0.004));
  CHECK_FALSE(box.revolution);
  for (int axis = 0; axis < 3; ++axis) {
    CHECK(box.contains(half_turn_about(Vector3d::Unit(axis)), radians(0.01)));
  }
  CHECK_FALSE(box.contains({Vector3d::Zero(), rotation_from_vector({0, 0, radians(90)})}, 0.1));
}

TEST_CASE("a box away from its origin turns about itself, not about the origin") {
  Mesh mesh;
  mesh.append(make_box({2, 1, 0.7}), {{0.4, -0.3, 0.2}, Quaterniond::Identity()});
  const SymmetryGroup group = symmetry_of_mesh(mesh);
  REQUIRE(group.motions.size() == 3);
  for (const Pose& motion : group.motions) {
    CHECK((motion * Vector3d(0.4, -0.3, 0.2) - Vector3d(0.4, -0.3, 0.2)).norm() < 1e-6);
  }
}

TEST_CASE("a small thing on one side leaves no symmetry") {
  Mesh mesh = make_box({1, 1, 1});
  mesh.append(make_box({0.3, 0.15, 0.1}), {{0.2, 0.1, 0.55}, Quaterniond::Identity()});
  CHECK(symmetry_of_mesh(mesh).trivial());
}

TEST_CASE("a cylinder may be turned about its axis by any angle, and upside down") {
  const SymmetryGroup group = symmetry_of_mesh(make_cylinder(0.3, 2, 64));
  REQUIRE(group.revolution);
  CHECK(std::abs(group.revolution->direction.z()) > 0.99999);
  CHECK(group.motions.size() == 1);
  const Pose pose{{0, 0, 5}, rotation_from_vector({0.3, 0.8, -0.4})};
  const Pose same = pose * half_turn_about(Vector3d::UnitX()) *
                    Pose{Vector3d::Zero(), rotation_from_vector({0, 0, 1.3})};
  const Pose back = group.nearest_equal(same, pose);
  CHECK(angle_between(back, pose) < radians(0.01));
  CHECK(distance(back, pose) < 1e-4);
}

TEST_CASE("a docking interface leaves the motions that leave it in place") {
  const SymmetryGroup box = symmetry_of_mesh(make_box({2, 1, 0.7}));
  const SymmetryGroup docked = box.keeping({1, 0, 0}, Vector3d::UnitX());
  REQUIRE(docked.motions.size() == 1);
  CHECK(docked.contains(half_turn_about(Vector3d::UnitX()), radians(0.01)));
  CHECK(box.keeping({1, 0.2, 0}, Vector3d::UnitX()).trivial());
  CHECK(box.keeping({0, 0, 0}, Vector3d(1, 1, 0).normalized()).trivial());
}

TEST_CASE("a symmetry is kept in a file, and what is none is refused") {
  SymmetryGroup group;
  group.tolerance_m = 0.006;
  const Pose third{{0.1, 0, -0.2}, rotation_from_vector({0, radians(120), 0})};
  group.motions = {third, third.inverse()};
  group.revolution = {{Vector3d(0.5, 0, 0), Vector3d::UnitX()}};
  const SymmetryGroup read = read_symmetry(yaml_of(group), "symmetry.yaml");
  REQUIRE(read.motions.size() == 2);
  CHECK(distance(read.motions[0], group.motions[0]) < 1e-9);
  CHECK(angle_between(read.motions[0], group.motions[0]) < 1e-7);
  REQUIRE(read.revolution);
  CHECK(read.revolution->point == group.revolution->point);
  CHECK(yaml_of(read) == yaml_of(group));
  CHECK(read_symmetry(yaml_of(SymmetryGroup()), "s").trivial());
  for (const char* bad :
       {"", "tolerance: 6 mm\nmotion: []\n", "tolerance: 6\nmotions: []\n",
        "tolerance: 6 mm\nmotions:\n  - pose: [0, 0, 0, 180, 0]\n",
        "tolerance: 6 mm\nmotions:\n  - pose: [200, 0, 0, 180, 0, 0]\n",
        "tolerance: 6 mm\nrevolution: {point: [0 mm, 0 mm, 0 mm], direction: [0, 0, 2]}\n"}) {
    CHECK_THROWS_WITH(read_symmetry(bad, "symmetry.yaml"), Catch::Contains("symmetry.yaml"));
  }
}

TEST_CASE("without symmetry a pose is left as it is, to the bit") {
  const Pose pose{{0.1, 0.2, 4}, rotation_from_vector({0.1, 0.2, 3.0})};
  const Pose same = SymmetryGroup().nearest_equal(pose, Pose{});
  CHECK(same.position == pose.position);
  CHECK(same.rotation.coeffs() == pose.rotation.coeffs());
}
