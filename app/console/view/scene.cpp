// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/view/scene.h"

#include "app/console/view/section.h"
#include "evaluation/measure/measurer.h"
#include "lcmtypes/conversions.h"
#include "lcmtypes/good_estimate.h"

namespace berth::console {
namespace {

std::string link_frame(const PlacedArm& arm, int link) {
  return std::string(name_of(arm.role)) + "-arm-" + std::to_string(link);
}

std::string flange_frame(const PlacedArm& arm) {
  return std::string(name_of(arm.role)) + "-flange";
}

std::string path_of(std::size_t body) { return "/mesh/" + std::to_string(body); }

/// What is worth looking at: the room, or the space about the arms where there is none.
Box box_of(const Cell& cell) {
  Mesh all;
  for (const RoomBody& part : cell.room) all.append(part.mesh);
  if (all.vertices.empty()) {
    const Vector3d reach = Vector3d::Constant(cell.target.length);
    for (const PlacedArm* arm : {&cell.replica, &cell.sensor}) {
      const Vector3d tool = arm->tool_pose(arm->home).position;
      all.vertices.insert(all.vertices.end(), {tool - reach, tool + reach});
    }
  }
  return bounding_box(all);
}

}  // namespace

std::vector<DrawnBody> drawn_bodies(const Cell& cell) {
  std::vector<DrawnBody> bodies;
  for (const PlacedArm* arm : {&cell.replica, &cell.sensor}) {
    for (const ArmBody& part : arm->kinematics->bodies()) {
      bodies.push_back({std::string(name_of(arm->role)) + " arm's " + part.name,
                        link_frame(*arm, part.link), "arm", part.mesh});
    }
  }
  bodies.push_back({"mount", flange_frame(cell.replica), "arm", cell.mount});
  bodies.push_back({"sensor", flange_frame(cell.sensor), "sensor", cell.sensor_housing});
  bodies.push_back({cell.target.name, "replica", "replica", cell.target.mesh});
  for (const RoomBody& part : cell.room) {
    bodies.push_back({part.name, "cell", part.keep_out ? "keepout" : "cell", part.mesh});
  }
  std::erase_if(bodies, [](const DrawnBody& body) { return body.mesh.triangles.empty(); });
  return bodies;
}

std::string scene_json(const Cell& cell, const LidarProfile& lidar,
                       const std::vector<DrawnBody>& bodies) {
  Json list = Json::array();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    list.push_back({{"name", bodies[i].name},
                    {"frame", bodies[i].frame},
                    {"mesh", path_of(i)},
                    {"kind", bodies[i].kind}});
  }
  const Box box = box_of(cell);
  return text_of(
      {{"layout", cell.layout},
       {"bodies", list},
       {"box", {{"min", json_of(box.low)}, {"max", json_of(box.high)}}},
       {"lidar",
        {{"model", lidar.model},
         {"field_of_view_rad",
          {rounded(lidar.field_of_view_width, 1e-6), rounded(lidar.field_of_view_height, 1e-6)}},
         {"range_min_m", lidar.beam.range_min_m},
         {"range_max_m", lidar.beam.range_max_m}}}});
}

std::map<std::string, std::string> mesh_texts(const std::vector<DrawnBody>& bodies) {
  std::map<std::string, std::string> texts;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const Mesh& mesh = bodies[i].mesh;
    Json positions = Json::array();
    Json indices = Json::array();
    for (const Vector3d& vertex : mesh.vertices) {
      for (const double value : vertex) positions.push_back(rounded(value, 1e-5));
    }
    for (const auto& triangle : mesh.triangles) {
      for (const std::uint32_t vertex : triangle) indices.push_back(vertex);
    }
    texts[path_of(i)] = text_of({{"positions", positions}, {"indices", indices}});
  }
  return texts;
}

Frames::Frames(const Cell& cell)
    : cell_(&cell), replica_(cell.replica.home), sensor_(cell.sensor.home) {}

void Frames::take(const CellMessages& latest) {
  // Where an arm was seen last is the best guess while its controller is silent.
  if (const auto joints = reported_joints(latest.replica_arm)) replica_ = *joints;
  if (const auto joints = reported_joints(latest.sensor_arm)) sensor_ = *joints;
}

Json Frames::json(const CellMessages& latest, Utime now) const {
  Json frames = Json::object();
  const auto add_arm = [&frames](const PlacedArm& arm, const Joints& joints) {
    const auto links = arm.kinematics->link_poses(joints);
    for (int link = 0; link < 7 && !arm.kinematics->bodies().empty(); ++link) {
      frames[link_frame(arm, link)] = json_of(arm.base * links[static_cast<std::size_t>(link)]);
    }
    frames[flange_frame(arm)] = json_of(arm.base * arm.kinematics->forward(joints));
  };
  add_arm(cell_->replica, replica_);
  add_arm(cell_->sensor, sensor_);
  const Pose at_sensor = sensor();
  const auto truth = latest.truth_at(now);
  frames["sensor"] = json_of(at_sensor);
  frames["replica"] = json_of(truth ? at_sensor * truth->pose : cell_->replica.tool_pose(replica_));
  if (const auto pose = estimated_pose(latest.estimate, now)) {
    frames["ghost"] = json_of(at_sensor * *pose);
  }
  return frames;
}

std::optional<Pose> estimated_pose(const std::optional<pose_estimate_t>& estimate, Utime now) {
  if (!estimate || !is_good(*estimate)) return std::nullopt;
  if (now - estimate->utime > evaluation::Measurer::estimate_lifetime) return std::nullopt;
  return moved(pose_of(*estimate), velocity_of(*estimate), seconds(now - estimate->utime));
}

}  // namespace berth::console
