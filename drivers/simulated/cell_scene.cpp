// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/cell_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace berth {

CellScene::CellScene(const Cell& world, JointsAt replica, JointsAt sensor,
                     const SceneSettings& settings)
    : replica_(make_arm(world.replica, std::move(replica))),
      sensor_(make_arm(world.sensor, std::move(sensor))) {
  const SurfaceShares& diffuse = settings.reflectivity;
  const SurfaceShares& specular = settings.specular;
  // The target first: most beams are meant for it, and a near hit spares the rest.
  add(replica_, world.target.mesh, tool_frame, diffuse.target, specular.target, true);
  for (const auto& v : world.target.mesh.vertices) {
    target_reach_ = std::max(target_reach_, v.norm());
  }
  add(replica_, world.mount, flange_frame, diffuse.mount, specular.mount);
  for (const ArmBody& body : world.replica.kinematics->bodies()) {
    add(replica_, body.mesh, static_cast<std::size_t>(body.link), diffuse.arm, specular.arm);
  }
  for (const ArmBody& body : world.sensor.kinematics->bodies()) {
    if (body.link == last_link) continue;
    add(sensor_, body.mesh, static_cast<std::size_t>(body.link), diffuse.arm, specular.arm);
  }
  Mesh room;
  for (const RoomBody& body : world.room) {
    if (!body.keep_out) room.append(body.mesh);
  }
  add(room_, room, 0, diffuse.room, specular.room);
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
                    double specular, bool target) {
  if (mesh.triangles.empty()) return;
  const Vector3d centre = bounding_box(mesh).centre();
  double radius = 0;
  for (const auto& v : mesh.vertices) radius = std::max(radius, (v - centre).norm());
  group.bodies.push_back(
      {RayCaster(mesh), centre, radius * 1.0001, reflectivity, specular, frame, target, centre});
}

bool CellScene::move(Arm& arm, Utime t) {
  const Joints joints = arm.joints_at(t);
  if (arm.placed_once && joints == arm.joints) return false;
  arm.placed_once = true;
  arm.joints = joints;
  const ArmKinematics& kinematics = *arm.placed.kinematics;
  const auto links = kinematics.link_poses(joints);
  std::copy(links.begin(), links.end(), arm.frames.begin());
  arm.frames[flange_frame] =
      arm.flange_is_last_link ? links[last_link] : kinematics.forward(joints);
  arm.frames[tool_frame] = arm.frames[flange_frame] * arm.placed.tool;
  for (Body& body : arm.bodies) body.place = arm.frames[body.frame] * body.centre;
  return true;
}

void CellScene::move_to(Utime t) {
  if (moved_ && t == time_) return;
  move(replica_, t);
  if (move(sensor_, t)) sensor_pose_ = sensor_.base * sensor_.frames[tool_frame];
  moved_ = true;
  time_ = t;
}

Pose CellScene::relative_pose(Utime t) {
  move_to(t);
  return sensor_pose_.inverse() * (replica_.base * replica_.frames[tool_frame]);
}

void CellScene::cast_at(const Group& group, const Ray& ray, Met& met) {
  const Quaterniond to_base = group.base.rotation.conjugate();
  const Vector3d origin = to_base * (ray.origin - group.base.position);
  const Vector3d direction = to_base * ray.direction;
  for (const Body& body : group.bodies) {
    const Vector3d to_centre = body.place - origin;
    const double along = to_centre.dot(direction);
    if (along < -body.radius || along - body.radius > met.range) continue;
    if (to_centre.squaredNorm() - along * along > body.radius * body.radius) continue;
    const Pose& frame = group.frames[body.frame];
    const Quaterniond to_body = frame.rotation.conjugate();
    const Ray own{to_body * (origin - frame.position), to_body * direction};
    RayHit hit;
    if (!body.caster.cast(own, met.range, hit)) continue;
    met.range = hit.range;
    met.body = &body;
    met.normal = group.base.rotation * (frame.rotation * hit.normal);
  }
}

bool CellScene::cast(Utime t, const Vector3d& direction, double max_range, SceneHit& hit) {
  move_to(t);
  const Pose& sensor = sensor_pose_;
  const Ray ray{sensor.position, sensor.rotation * direction};
  Met met{max_range};
  cast_at(replica_, ray, met);
  cast_at(sensor_, ray, met);
  cast_at(room_, ray, met);
  if (occlusion_ > 0 && meets_plate(sensor, direction, met.range, hit)) return true;
  if (met.body == nullptr) return false;
  hit.range = met.range;
  hit.normal = sensor.rotation.conjugate() * met.normal;
  hit.incidence = std::acos(std::clamp(-direction.dot(hit.normal), 0.0, 1.0));
  hit.reflectivity = met.body->reflectivity;
  hit.specular = met.body->specular;
  hit.target = met.body->target;
  return true;
}

bool CellScene::meets_plate(const Pose& sensor, const Vector3d& direction, double range,
                            SceneHit& hit) const {
  constexpr double gap = 0.2;  // m between the plate and the nearest the target can reach
  const Vector3d target =
      (sensor.inverse() * (replica_.base * replica_.frames[tool_frame])).position;
  const double depth = target.z() - target_reach_ - gap;
  if (depth <= 0 || direction.z() <= 0 || depth / direction.z() >= range) return false;
  // Its edge lies on the line of sight to the last point that it hides.
  const double scale = depth / target.z();
  const double edge = scale * (target.x() + (2 * occlusion_ - 1) * target_reach_);
  const Vector3d point = depth / direction.z() * direction;
  if (point.x() > edge || std::abs(point.x() - scale * target.x()) > 2 * target_reach_ ||
      std::abs(point.y() - scale * target.y()) > target_reach_) {
    return false;
  }
  hit = SceneHit{};
  hit.range = depth / direction.z();
  hit.incidence = std::acos(direction.z());
  hit.reflectivity = 0.5;
  hit.normal = -Vector3d::UnitZ();
  return true;
}

Vector3d SunLamp::towards() const {
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
          std::sin(elevation)};
}

Sunlight CellScene::sunlight(Utime t) {
  const SunLamp lamp = sun_lamp_ ? sun_lamp_() : SunLamp{};
  if (lamp.level <= 0) return {};
  move_to(t);
  const Pose& sensor = sensor_pose_;
  const Ray ray{sensor.position, lamp.towards()};
  Sunlight sun{lamp.level, sensor.rotation.conjugate() * ray.direction, false};
  if (sun.towards.z() <= 0) return sun;  // behind the aperture
  Met met{std::numeric_limits<double>::infinity()};
  cast_at(replica_, ray, met);
  cast_at(sensor_, ray, met);
  sun.in_view = met.body == nullptr;
  return sun;
}

}  // namespace berth
