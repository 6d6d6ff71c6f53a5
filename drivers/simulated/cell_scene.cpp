// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/cell_scene.h"

#include <algorithm>
#include <cmath>

namespace berth {

CellScene::CellScene(const Cell& world, JointsAt replica, JointsAt sensor,
                     const SceneSettings& settings) {
  replica_.placed = world.replica;
  replica_.joints = std::move(replica);
  sensor_.placed = world.sensor;
  sensor_.joints = std::move(sensor);

  // The target first: most beams are meant for it, and a near hit spares the rest.
  add(replica_.bodies, world.target.mesh, tool_link, settings.target_reflectivity, true);
  add(replica_.bodies, world.mount, flange_link, settings.mount_reflectivity);
  for (const ArmBody& body : world.replica.kinematics->bodies()) {
    add(replica_.bodies, body.mesh, body.link, settings.arm_reflectivity);
  }
  for (const ArmBody& body : world.sensor.kinematics->bodies()) {
    if (body.link < 6) add(sensor_.bodies, body.mesh, body.link, settings.arm_reflectivity);
  }
  Mesh room;
  for (const RoomBody& body : world.room) {
    if (!body.keep_out) room.append(body.mesh);
  }
  add(room_, room, room_link, settings.room_reflectivity);
  for (Body& body : room_) place(body, {});
}

void CellScene::add(std::vector<Body>& bodies, const Mesh& mesh, int link, double reflectivity,
                    bool target) {
  if (mesh.triangles.empty()) return;
  const Vector3d centre = bounding_box(mesh).centre();
  double radius = 0;
  for (const auto& v : mesh.vertices) radius = std::max(radius, (v - centre).norm());
  bodies.push_back({RayCaster(mesh), centre, radius * 1.0001, reflectivity, link, target,
                    Vector3d::Zero(), Vector3d::Zero(), Matrix3d::Identity()});
}

void CellScene::place(Body& body, const Pose& pose) {
  body.cell_centre = pose * body.centre;
  body.position = pose.position;
  body.to_body = pose.rotation.toRotationMatrix().transpose();
}

void CellScene::move(Arm& arm, Utime t) {
  const Joints joints = arm.joints(t);
  if (arm.known && joints == arm.now) return;
  arm.known = true;
  arm.now = joints;
  const PlacedArm& placed = arm.placed;
  const Pose flange = placed.base * placed.kinematics->forward(joints);
  arm.tool = flange * placed.tool;
  const bool links = std::any_of(arm.bodies.begin(), arm.bodies.end(),
                                 [](const Body& body) { return body.link < flange_link; });
  std::array<Pose, 7> link_poses;
  if (links) link_poses = placed.kinematics->link_poses(joints);
  for (Body& body : arm.bodies) {
    place(body, body.link == tool_link ? arm.tool
                : body.link == flange_link
                    ? flange
                    : placed.base * link_poses[static_cast<std::size_t>(body.link)]);
  }
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
  return sensor_.tool.inverse() * replica_.tool;
}

void CellScene::cast_at(const std::vector<Body>& bodies, const Ray& ray, double& nearest,
                        const Body*& met, RayHit& hit) {
  for (const Body& body : bodies) {
    const Vector3d to_centre = body.cell_centre - ray.origin;
    const double along = to_centre.dot(ray.direction);
    if (along < -body.radius || along - body.radius > nearest) continue;
    if (to_centre.squaredNorm() - along * along > body.radius * body.radius) continue;
    const Ray own{body.to_body * (ray.origin - body.position), body.to_body * ray.direction};
    RayHit found;
    if (!body.caster.cast(own, nearest, found)) continue;
    nearest = found.range;
    met = &body;
    hit = found;
    hit.normal = own.direction * own.direction.dot(found.normal);  // all that incidence needs
  }
}

bool CellScene::cast(Utime t, const Vector3d& direction, double max_range, SceneHit& hit) {
  move_to(t);
  const Ray ray{sensor_.tool.position, sensor_.tool.rotation * direction};
  double nearest = max_range;
  const Body* met = nullptr;
  RayHit found;
  cast_at(replica_.bodies, ray, nearest, met, found);
  cast_at(sensor_.bodies, ray, nearest, met, found);
  cast_at(room_, ray, nearest, met, found);
  if (met == nullptr) return false;
  hit.range = nearest;
  hit.incidence = std::acos(std::clamp(found.normal.norm(), 0.0, 1.0));
  hit.reflectivity = met->reflectivity;
  hit.target = met->target;
  return true;
}

}  // namespace berth
