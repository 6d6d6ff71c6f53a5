// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/core/arm_kinematics.h"
#include "common/core/run_setup.h"
#include "common/targets/target.h"

namespace berth {

enum class ArmRole { replica, sensor };
const char* name_of(ArmRole role);

/// One arm and its place in the cell.
struct PlacedArm {
  ArmRole role = ArmRole::replica;
  std::shared_ptr<const ArmKinematics> kinematics;
  Pose base;      ///< T_cell_base
  Pose tool;      ///< T_flange_sensor or T_flange_model
  Joints home{};  ///< where it waits

  /// T_cell_tool at the joints.
  Pose tool_pose(const Joints& joints) const { return base * kinematics->forward(joints) * tool; }
};

/// A fixed body of the room.
struct RoomBody {
  std::string name;
  Mesh mesh;              ///< cell frame
  bool keep_out = false;  ///< invisible: a volume that must not be entered
};

/// The nominal cell: a layout file (config/layouts) with the target mounted.
/// Cell frame: z up, floor at z = 0, x from the sensor arm's base to the replica arm's.
struct Cell {
  std::string layout;
  PlacedArm replica;
  PlacedArm sensor;
  std::string lidar;          ///< config/lidars/<lidar>.yaml; empty: that of devices.yaml
  double greatest_speed = 0;  ///< m/s, limit of relative motion in this layout; 0: the testbed's
  double sensor_share = 0.5;  ///< of the travel along the line of sight that the sensor arm takes
  Mesh mount;                 ///< between the replica arm's flange and the target, flange frame
  Mesh sensor_housing;        ///< flange frame of the sensor arm
  std::vector<RoomBody> room;
  Target target;

  const PlacedArm& arm(ArmRole role) const { return role == ArmRole::replica ? replica : sensor; }
  /// T_sensor_model.
  Pose relative_pose(const Joints& replica_joints, const Joints& sensor_joints) const;
};

/// Reads a layout; file names in it are relative to the configuration directory (its parent's
/// parent). The mount's length follows the target's size. @throws InputError.
Cell load_cell(const std::filesystem::path& layout_file, const Target& target);
/// Of a run, with its target.
Cell load_cell(const RunSetup& run);

/// Cell::relative_pose, cached: computed anew only when a joint has moved. For one thread.
class RelativePose {
 public:
  /// The cell must outlive it.
  explicit RelativePose(const Cell& cell) : cell_(cell) {}

  const Pose& at(const Joints& replica, const Joints& sensor) {
    if (known_ && replica == replica_ && sensor == sensor_) return pose_;
    known_ = true;
    replica_ = replica;
    sensor_ = sensor;
    return pose_ = cell_.relative_pose(replica, sensor);
  }

 private:
  const Cell& cell_;
  bool known_ = false;
  Joints replica_{};
  Joints sensor_{};
  Pose pose_;
};

}  // namespace berth
