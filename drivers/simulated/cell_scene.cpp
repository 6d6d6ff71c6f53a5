// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/cell_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace berth {

namespace {

/// Within this time an arm's links move along straight lines, to some micrometres.
constexpr Utime max_span = 5 * millisecond;

/// Between two poses that are close together.
Pose blend(const Pose& a, const Pose& b, double s) {
  const double side = a.rotation.dot(b.rotation) < 0 ? -s : s;
  const Eigen::Vector4d mixed = (1 - s) * a.rotation.coeffs() + side * b.rotation.coeffs();
  return {(1 - s) * a.position + s * b.position, Quaterniond(mixed.normalized())};
}

/// Whether a ray misses a box about the origin, or meets it only beyond a distance.
bool passes(const Vector3d& origin, const Vector3d& direction, const Eigen::Array3d& half_size,
            double until) {
  double enters = 0;
  double leaves = until;
  for (int i = 0; i < 3; ++i) {
    const double inverse = 1 / direction[i];  // infinite is right
    const double a = (-half_size[i] - origin[i]) * inverse;
    const double b = (half_size[i] - origin[i]) * inverse;
    // In this order of arguments NaN (a ray within a side's plane) does not exclude a hit.
    enters = std::max(enters, std::min(a, b));
    leaves = std::min(leaves, std::max(a, b));
  }
  return enters > leaves;
}

}  // namespace

CellScene::CellScene(const Cell& world, JointsAt replica, JointsAt sensor,
                     const SceneSettings& settings)
    : replica_(make_arm(world.replica, std::move(replica))),
      sensor_(make_arm(world.sensor, std::move(sensor))) {
  // The target first: most beams are meant for it, and a near hit spares the rest.
  if (!world.target.mesh.triangles.empty()) {
    Body& target =
        add(replica_, world.target.mesh, tool_frame, world.target.parts.front().material);
    target.target = true;
    target.materials.clear();
    for (const TargetPart& part : world.target.parts) target.materials.push_back(part.material);
    target.material_of = world.target.part_of;
  }
  for (const auto& v : world.target.mesh.vertices) {
    target_reach_ = std::max(target_reach_, v.norm());
  }
  if (!world.mount.triangles.empty()) add(replica_, world.mount, flange_frame, settings.mount);
  for (const ArmBody& body : world.replica.kinematics->bodies()) {
    if (body.mesh.triangles.empty()) continue;
    add(replica_, body.mesh, static_cast<std::size_t>(body.link), settings.arm);
  }
  for (const ArmBody& body : world.sensor.kinematics->bodies()) {
    if (body.link == last_link || body.mesh.triangles.empty()) continue;
    add(sensor_, body.mesh, static_cast<std::size_t>(body.link), settings.arm);
  }
  Mesh room;
  for (const RoomBody& body : world.room) {
    if (!body.keep_out) room.append(body.mesh);
  }
  if (!room.triangles.empty()) add(room_, room, 0, settings.room);
}

Pose CellScene::Group::frame(std::size_t i) const {
  return done == 0 ? frames[i] : blend(frames[i], next[i], done);
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

CellScene::Body& CellScene::add(Group& group, const Mesh& mesh, std::size_t frame,
                                const Material& material) {
  const Box box = bounding_box(mesh);
  const Vector3d centre = box.centre();
  double radius = 0;
  for (const auto& v : mesh.vertices) radius = std::max(radius, (v - centre).norm());
  group.bodies.push_back({RayCaster(mesh),
                          centre,
                          radius * 1.001,  // covers the error of its approximate place
                          0.5 * box.size(),
                          frame,
                          false,
                          {material},
                          {},
                          group.base * centre});
  return group.bodies.back();
}

void CellScene::find_knot(const Arm& arm, Utime t, Knot& knot) {
  if (knot.known && knot.time == t) return;
  const Joints joints = arm.joints_at(t);
  const bool same = knot.known && joints == knot.joints;
  knot.time = t;
  if (same) return;
  knot.joints = joints;
  knot.known = true;
  const ArmKinematics& kinematics = *arm.placed.kinematics;
  const auto links = kinematics.link_poses(joints);
  std::copy(links.begin(), links.end(), knot.frames.begin());
  knot.frames[flange_frame] =
      arm.flange_is_last_link ? links[last_link] : kinematics.forward(joints);
  knot.frames[tool_frame] = knot.frames[flange_frame] * arm.placed.tool;
}

bool CellScene::move(Arm& arm, Utime t, Utime next) {
  Knot& before = arm.before;
  Knot& after = arm.after;
  const bool between = before.known && before.time <= t && t <= after.time && after.time <= next;
  if (!between) {
    const Joints was = before.joints;
    const bool follows = after.known && after.time <= t && t - after.time < max_span;
    if (follows && next > t) {
      before = after;
    } else {
      find_knot(arm, t, before);
    }
    if (next > t) find_knot(arm, std::min(next, before.time + max_span), after);
    if (before.joints != was) arm.placed_once = false;
    arm.frames = before.frames;
    arm.next = after.frames;
    for (Body& body : arm.bodies) {
      body.place_before = arm.base * (arm.frames[body.frame] * body.centre);
      body.place_after = arm.base * (arm.next[body.frame] * body.centre);
    }
  }
  const bool at_rest = t == before.time || before.joints == after.joints;
  if (at_rest && arm.placed_once) return false;
  arm.done = at_rest ? 0
                     : static_cast<double>(t - before.time) /
                           static_cast<double>(after.time - before.time);
  arm.placed_once = at_rest;
  for (Body& body : arm.bodies) {
    body.place = body.place_before + arm.done * (body.place_after - body.place_before);
  }
  return true;
}

void CellScene::prepare(Utime last) { prepared_until_ = last; }

void CellScene::move_to(Utime t) {
  if (moved_ && t == time_) return;
  const Utime next = std::max(t, prepared_until_);
  if (move(replica_, t, next)) ++state_;
  if (move(sensor_, t, next)) {
    ++state_;
    sensor_pose_ = sensor_.base * sensor_.frame(tool_frame);
    sensor_turn_ = sensor_pose_.rotation.toRotationMatrix();
  }
  moved_ = true;
  time_ = t;
}

Pose CellScene::relative_pose(Utime t) {
  move_to(t);
  return sensor_pose_.inverse() * (replica_.base * replica_.frame(tool_frame));
}

void CellScene::see_from(const Group& group, const Body& body) const {
  if (body.seen_in == state_) return;
  body.seen_in = state_;
  const Pose frame = group.frame(body.frame);
  body.to_body = (group.base.rotation * frame.rotation).conjugate().toRotationMatrix();
  body.sensor_turn = body.to_body * sensor_turn_;
  body.sensor_place = body.to_body * (sensor_pose_.position - group.base * frame.position);
}

void CellScene::cast_at(const Group& group, std::span<const Ray> rays, std::span<Met> met) const {
  const std::size_t count = rays.size();
  const Ray middle{sensor_pose_.position + sensor_turn_ * rays[0].origin,
                   sensor_turn_ * rays[0].direction};
  double apart = 0;   // of the rays' origins from the first one's
  double spread = 0;  // of their directions
  for (std::size_t i = 1; i < count; ++i) {
    apart = std::max(apart, (rays[i].origin - rays[0].origin).squaredNorm());
    spread = std::max(spread, (rays[i].direction - rays[0].direction).squaredNorm());
  }
  apart = std::sqrt(apart);
  spread = std::sqrt(spread);
  const auto farthest = [&] {
    double range = 0;
    for (const Met& one : met) range = std::max(range, one.range);
    return range;
  };
  double until = farthest();
  for (const Body& body : group.bodies) {
    const Vector3d to_centre = body.place - middle.origin;
    const double along = to_centre.dot(middle.direction);
    const double half_width = apart + spread * (std::max(along, 0.0) + body.radius);
    const double reach = body.radius + half_width;
    if (along < -reach || along - reach > until) continue;
    if (to_centre.squaredNorm() - along * along > reach * reach) continue;
    see_from(group, body);
    const Matrix3d& turn = body.sensor_turn;
    const Vector3d origin = body.sensor_place + turn * rays[0].origin;
    if (passes(origin - body.centre, body.to_body * middle.direction,
               body.half_size.array() + half_width, until)) {
      continue;
    }
    const auto keep = [&](const RayHit& hit, Met& nearest) {
      if (!(hit.range < nearest.range)) return;
      nearest = {hit.range, &body, hit.triangle, turn.transpose() * hit.normal};
    };
    if (count == 1) {
      RayHit hit;
      if (body.caster.cast({origin, turn * rays[0].direction}, until, hit)) keep(hit, met[0]);
    } else {
      std::array<Ray, max_rays> own;
      std::array<RayHit, max_rays> hits;
      for (std::size_t i = 0; i < count; ++i) {
        own[i] = {origin + turn * (rays[i].origin - rays[0].origin), turn * rays[i].direction};
      }
      body.caster.cast({own.data(), count}, until, {hits.data(), count});
      for (std::size_t i = 0; i < count; ++i) keep(hits[i], met[i]);
    }
    until = farthest();
  }
}

void CellScene::cast(Utime t, std::span<const Ray> rays, double max_range,
                     std::span<SceneHit> hits) {
  move_to(t);
  const std::size_t count = std::min(rays.size(), max_rays);
  std::array<Met, max_rays> all;
  const std::span<Met> met{all.data(), count};
  for (Met& one : met) one = Met{max_range, nullptr, 0, Vector3d::Zero()};
  for (const Group* group : std::initializer_list<const Group*>{&replica_, &sensor_, &room_}) {
    cast_at(*group, rays.first(count), met);
  }
  for (std::size_t i = 0; i < count; ++i) {
    SceneHit& hit = hits[i];
    hit = SceneHit{};
    if (occlusion_ > 0 && meets_plate(sensor_pose_, rays[i].direction, met[i].range, hit)) continue;
    const Body* body = met[i].body;
    if (body == nullptr) continue;
    hit.range = met[i].range;
    hit.normal = met[i].normal;
    hit.cosine = std::clamp(-rays[i].direction.dot(hit.normal), 0.0, 1.0);
    hit.material =
        body->materials[body->material_of.empty() ? 0 : body->material_of[met[i].triangle]];
    hit.target = body->target;
  }
}

bool CellScene::meets_plate(const Pose& sensor, const Vector3d& direction, double range,
                            SceneHit& hit) const {
  constexpr double gap = 0.2;  // m between the plate and the nearest the target can reach
  const Vector3d target =
      (sensor.inverse() * (replica_.base * replica_.frame(tool_frame))).position;
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
  hit.cosine = direction.z();
  hit.normal = -Vector3d::UnitZ();
  return true;
}

Vector3d SunLamp::towards() const {
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
          std::sin(elevation)};
}

Sunlight CellScene::sunlight(Utime t) {
  const SunLamp lamp = sun_lamp_ ? sun_lamp_() : SunLamp{};
  Sunlight sun;
  sun.albedo = lamp.albedo;
  if (lamp.level <= 0) return sun;
  move_to(t);
  sun.level = lamp.level;
  sun.towards = sensor_turn_.transpose() * lamp.towards();
  if (sun.towards.z() <= 0) return sun;  // behind the aperture
  const Ray ray{Vector3d::Zero(), sun.towards};
  Met met{std::numeric_limits<double>::infinity(), nullptr, 0, Vector3d::Zero()};
  cast_at(replica_, {&ray, 1}, {&met, 1});
  cast_at(sensor_, {&ray, 1}, {&met, 1});
  sun.in_view = met.body == nullptr;
  return sun;
}

}  // namespace berth
