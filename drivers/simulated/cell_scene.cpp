// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/cell_scene.h"

#include <algorithm>
#include <cmath>

namespace berth {

CellScene::CellScene(const Cell& world, JointsAt replica, JointsAt sensor,
                     const SceneSettings& settings)
    : replica_(make_arm(world.replica, std::move(replica))),
      sensor_(make_arm(world.sensor, std::move(sensor))) {
  // The target first: most beams are meant for it, and a near hit spares the rest.
  add(replica_, world.target.mesh, tool_frame, settings.target_reflectivity, true);
  add(replica_, world.mount, flange_frame, settings.mount_reflectivity);
  for (const ArmBody& body : world.replica.kinematics->bodies()) {
    add(replica_, body.mesh, static_cast<std::size_t>(body.link), settings.arm_reflectivity);
  }
  for (const ArmBody& body : world.sensor.kinematics->bodies()) {
    if (body.link == last_link) continue;
    add(sensor_, body.mesh, static_cast<std::size_t>(body.link), settings.arm_reflectivity);
  }
  Mesh room;
  for (const RoomBody& body : world.room) {
    if (!body.keep_out) room.append(body.mesh);
  }
  add(room_, room, 0, settings.room_reflectivity);
}

CellScene::Arm CellScene::make_arm(const PlacedArm& placed, JointsAt joints_at) {
  Arm arm;
  arm.placed = placed;
  arm.base = placed.base;
  arm.joints_at = std::move(joints_at);
  const ArmKinematics& kinematics = *placed.kinematics;
  const Pose flange = kinematics.forward(placed.home);
  const Pose last = kinematics.link_poses(placed.home)[last_link];
  arm.flange_is_last_link = difference(flange, last).norm() < 1e-12;
  return arm;
}

void CellScene::add(Group& group, const Mesh& mesh, std::size_t frame, double reflectivity,
                    bool target) {
  if (mesh.triangles.empty()) return;
  const Vector3d centre = bounding_box(mesh).centre();
  double radius = 0;
  for (const auto& v : mesh.vertices) radius = std::max(radius, (v - centre).norm());
  group.bodies.push_back({RayCaster(mesh), centre, radius * 1.0001, reflectivity, frame, target});
}

void CellScene::move(Arm& arm, Utime t) {
  const Joints joints = arm.joints_at(t);
  if (arm.placed_once && joints == arm.joints) return;
  arm.placed_once = true;
  arm.joints = joints;
  const ArmKinematics& kinematics = *arm.placed.kinematics;
  const auto links = kinematics.link_poses(joints);
  std::copy(links.begin(), links.end(), arm.frames.begin());
  arm.frames[flange_frame] =
      arm.flange_is_last_link ? links[last_link] : kinematics.forward(joints);
  arm.frames[tool_frame] = arm.frames[flange_frame] * arm.placed.tool;
}

void CellScene::move_to(Utime t) {
  if (moved_ && t == time_) return;
  move(replica_, t);
  move(sensor_, t);
  moved_ = true;
  time_ = t;
}

Pose CellScene::relative_pose(Utime t) {
  move_to(t);
  return (sensor_.base * sensor_.frames[tool_frame]).inverse() *
         (replica_.base * replica_.frames[tool_frame]);
}

void CellScene::cast_at(const Group& group, const Ray& ray, double& nearest, const Body*& met,
                        double& facing) {
  const Quaterniond to_base = group.base.rotation.conjugate();
  const Vector3d origin = to_base * (ray.origin - group.base.position);
  const Vector3d direction = to_base * ray.direction;
  for (const Body& body : group.bodies) {
    const Pose& frame = group.frames[body.frame];
    const Vector3d to_centre = frame * body.centre - origin;
    const double along = to_centre.dot(direction);
    if (along < -body.radius || along - body.radius > nearest) continue;
    if (to_centre.squaredNorm() - along * along > body.radius * body.radius) continue;
    const Quaterniond to_body = frame.rotation.conjugate();
    const Ray own{to_body * (origin - frame.position), to_body * direction};
    RayHit hit;
    if (!body.caster.cast(own, nearest, hit)) continue;
    nearest = hit.range;
    met = &body;
    facing = -own.direction.dot(hit.normal);
  }
}

bool CellScene::cast(Utime t, const Vector3d& direction, double max_range, SceneHit& hit) {
  move_to(t);
  const Pose sensor = sensor_.base * sensor_.frames[tool_frame];
  const Ray ray{sensor.position, sensor.rotation * direction};
  double nearest = max_range;
  double facing = 0;
  const Body* met = nullptr;
  cast_at(replica_, ray, nearest, met, facing);
  cast_at(sensor_, ray, nearest, met, facing);
  cast_at(room_, ray, nearest, met, facing);
  if (met == nullptr) return false;
  hit.range = nearest;
  hit.incidence = std::acos(std::clamp(facing, 0.0, 1.0));
  hit.reflectivity = met->reflectivity;
  hit.target = met->target;
  return true;
}

}  // namespace berth
