// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/cell.h"

#include <algorithm>
#include <cmath>

#include "common/core/body_shapes.h"
#include "common/core/ray_caster.h"

namespace berth {
namespace {

constexpr int mount_sides = 16;

Joints read_home(Config& config, const ArmKinematics& arm) {
  const YamlNode list = config.raw("home", "list of six joints");
  Joints home{};
  if (!list.is_list() || list.size() != home.size()) {
    throw config.error("home", "expected a list of six joints");
  }
  for (std::size_t i = 0; i < home.size(); ++i) {
    const Dimension dimension =
        arm.is_linear(static_cast<int>(i)) ? Dimension::length : Dimension::angle;
    try {
      home[i] = parse_quantity(list.items()[i].text(), dimension);
    } catch (const InputError& e) {
      throw config.error("home", "joint " + std::to_string(i + 1) + ": " + e.what());
    }
  }
  const std::string violation = arm.limit_violation(home);
  if (!violation.empty()) throw config.error("home", violation);
  return home;
}

PlacedArm read_arm(Config& config, ArmRole role, const std::filesystem::path& directory) {
  PlacedArm arm;
  arm.role = role;
  arm.kinematics = ArmKinematics::load(directory / config.text("arm"));
  arm.base = config.pose("base");
  arm.home = read_home(config, *arm.kinematics);
  return arm;
}

/// A rod from the faceplate to where the target's back is met, or to its origin when it has a hole
/// there.
Mesh make_mount(const Mesh& target, const Pose& flange_model, double diameter) {
  const Pose model_flange = flange_model.inverse();
  const Ray ray{model_flange.position, model_flange.rotation * Vector3d::UnitZ()};
  RayHit hit;
  double length = flange_model.position.z();
  if (RayCaster(target).cast(ray, length, hit)) length = hit.range;
  Mesh mount;
  mount.append(make_cylinder(0.5 * diameter, length, mount_sides),
               {Vector3d(0, 0, 0.5 * length), Quaterniond::Identity()});
  return mount;
}

/// How long the rod must be for all of the target to be beyond the gap.
double rod_length(const Mesh& target, const Quaterniond& attitude, double gap) {
  double back = 0;
  for (const Vector3d& vertex : target.vertices) {
    back = std::max(back, -(attitude * vertex).z());
  }
  return gap + back;
}

/// The target is held where its description defines the mount. By default it hangs on the
/// faceplate's axis: by its back, or by its side where that rod would be too long for the arm to
/// make room behind it.
void mount_target(Config& config, Cell& cell) {
  const double gap = config.quantity("gap", Dimension::length, at_least(0));
  const double diameter = config.quantity("diameter", Dimension::length, above(0));
  const double longest = config.quantity("longest", Dimension::length);
  const Quaterniond back = config.pose("back").rotation;
  const Quaterniond side = config.pose("side").rotation;
  config.finish();
  const Mesh& target = cell.target.mesh;
  const bool by_back =
      rod_length(target, back, gap) <= std::max(longest, rod_length(target, side, gap));
  const Quaterniond& attitude = by_back ? back : side;
  cell.replica.tool =
      cell.target.mount.value_or(Pose{Vector3d(0, 0, rod_length(target, attitude, gap)), attitude});
  cell.mount = make_mount(target, cell.replica.tool, diameter);
}

/// The replica arm's joints, nearest to those given, that place the target before the sensor at
/// home, for any length of rod. Those given, where there are none.
Joints home_with_target(const Cell& cell, const Pose& relative) {
  const PlacedArm& arm = cell.replica;
  const Pose model = cell.sensor.tool_pose(cell.sensor.home) * relative;
  Joints best = arm.home;
  double best_distance = -1;
  for (const InverseSolution& solution :
       arm.kinematics->inverse(arm.base.inverse() * model * arm.tool.inverse(), nullptr)) {
    double distance = 0;
    for (std::size_t i = 0; i < 6; ++i) {
      distance += std::pow(solution.joints[i] - arm.home[i], 2);
    }
    if (best_distance >= 0 && distance >= best_distance) continue;
    best = solution.joints;
    best_distance = distance;
  }
  return best;
}

}  // namespace

const char* name_of(ArmRole role) { return role == ArmRole::replica ? "replica" : "sensor"; }

Pose Cell::relative_pose(const Joints& replica_joints, const Joints& sensor_joints) const {
  return sensor.tool_pose(sensor_joints).inverse() * replica.tool_pose(replica_joints);
}

Cell load_cell(const std::filesystem::path& layout_file, const Target& target) {
  const std::filesystem::path directory =
      std::filesystem::absolute(layout_file).parent_path().parent_path();
  Config config = Config::load(layout_file);
  Cell cell;
  cell.layout = layout_file.stem().string();
  cell.target = target;

  Config replica = config.section("replica");
  cell.replica = read_arm(replica, ArmRole::replica, directory);
  if (replica.has("mount")) {
    Config mount = replica.section("mount");
    mount_target(mount, cell);
  }
  const bool home_by_pose = replica.has("home_pose");
  Pose home_pose;
  replica.optional("home_pose", home_pose);
  replica.finish();

  Config sensor = config.section("sensor");
  cell.sensor = read_arm(sensor, ArmRole::sensor, directory);
  sensor.optional("tool", cell.sensor.tool);
  for (Config part : sensor.sections("housing")) {
    cell.sensor_housing.append(read_shape(part));
    part.finish();
  }
  sensor.finish();
  if (home_by_pose) cell.replica.home = home_with_target(cell, home_pose);

  config.optional("lidar", cell.lidar);
  config.optional("greatest_speed", Dimension::speed, cell.greatest_speed, at_least(0));
  config.optional("sensor_share", cell.sensor_share, within(0, 1));
  for (Config part : config.sections("room")) {
    RoomBody body;
    body.name = part.text("name");
    part.optional("keep_out", body.keep_out);
    body.mesh = read_shape(part);
    part.finish();
    cell.room.push_back(std::move(body));
  }
  config.finish();
  return cell;
}

Cell load_cell(const RunSetup& run) {
  return load_cell(run.layout_file(), load_target(run.target, run.target_length));
}

}  // namespace berth
