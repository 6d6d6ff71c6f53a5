// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/cell.h"

#include <cmath>

#include "common/core/ray_caster.h"
#include "test/catch.h"

namespace berth {
namespace {

using Catch::Matchers::Contains;

Vector3d x_of(const Pose& pose) { return pose.rotation * Vector3d::UnitX(); }
Vector3d y_of(const Pose& pose) { return pose.rotation * Vector3d::UnitY(); }
Vector3d z_of(const Pose& pose) { return pose.rotation * Vector3d::UnitZ(); }

TEST_CASE("in the layouts with arms the sensor looks at the replica, and the replica looks back") {
  const Target target = load_target("radarsat2", 0);
  for (const std::string layout : {"range", "contact"}) {
    const Cell cell = load_cell("config/layouts/" + layout + ".yaml", target);
    CHECK(cell.layout == layout);
    const Pose sensor = cell.sensor.tool_pose(cell.sensor.home);
    CHECK(z_of(sensor).dot(Vector3d::UnitX()) > 0.99);   // boresight along the cell
    CHECK(y_of(sensor).dot(-Vector3d::UnitZ()) > 0.99);  // y down
    const Pose relative = cell.relative_pose(cell.replica.home, cell.sensor.home);
    CHECK(z_of(relative).dot(Vector3d::UnitZ()) > 0.999);
    CHECK(x_of(relative).dot(Vector3d::UnitX()) > 0.999);
    CHECK(std::hypot(relative.position.x(), relative.position.y()) < 0.01);
    CHECK(relative.position.z() == Approx(layout == "range" ? 5.5 : 3.2).margin(0.01));
    CHECK(cell.room.size() >= 5);
  }
}

TEST_CASE("the mount keeps the target off the faceplate, whatever its size") {
  for (const double length : {0.5, 3.0}) {
    const Target target = load_target("radarsat2", length);
    const Cell cell = load_cell("config/layouts/range.yaml", target);
    double nearest = 1e9;
    for (const Vector3d& vertex : target.mesh.vertices) {
      nearest = std::min(nearest, (cell.replica.tool * vertex).z());
    }
    CHECK(nearest == Approx(0.25));
    // the rod ends on the target's back
    const double end = bounding_box(cell.mount).high.z();
    CHECK(bounding_box(cell.mount).low.z() == Approx(0).margin(1e-9));
    const Pose model_flange = cell.replica.tool.inverse();
    const Vector3d tip = model_flange * Vector3d(0, 0, end);
    CHECK((RayCaster(target.mesh).nearest(tip) - tip).norm() < 1e-4);
  }
}

TEST_CASE("a target too deep to be held from behind is held by its side, where it stood before") {
  Target deep;
  deep.mesh = make_box(Vector3d(0.6, 0.4, 3.0));
  const Cell cell = load_cell("config/layouts/range.yaml", deep);
  CHECK(cell.replica.tool.position.z() == Approx(0.25 + 0.3));
  const Pose relative = cell.relative_pose(cell.replica.home, cell.sensor.home);
  CHECK(distance(relative, pose_from_xyzwpr({0, 0, 5500, 0, 0, 0})) < 1e-6);
  CHECK(angle_between(relative, Pose{}) < 1e-6);
  const Cell flat = load_cell("config/layouts/range.yaml", load_target("radarsat2", 0));
  CHECK(distance(relative, flat.relative_pose(flat.replica.home, flat.sensor.home)) < 1e-3);
}

TEST_CASE("in free space the replica's axes are its pose in the sensor frame") {
  const Cell cell = load_cell("config/layouts/free.yaml", load_target("radarsat2", 0));
  const Pose pose = pose_from_xyzwpr({100, -230, 8000, 25, 20, -30});
  const auto solutions = cell.replica.kinematics->inverse(pose, nullptr);
  REQUIRE_FALSE(solutions.empty());
  const Pose relative = cell.relative_pose(solutions[0].joints, cell.sensor.home);
  CHECK(distance(relative, pose) < 1e-9);
  CHECK(angle_between(relative, pose) < 1e-9);
  CHECK(cell.mount.triangles.empty());
  CHECK(cell.room.empty());
}

TEST_CASE("a layout that does not exist is named") {
  CHECK_THROWS_WITH(load_cell("config/layouts/nowhere.yaml", Target{}), Contains("nowhere.yaml"));
}

}  // namespace
}  // namespace berth
