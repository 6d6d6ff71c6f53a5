// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include "app/console/view/cell_status.h"
#include "app/console/view/section.h"
#include "common/core/cell.h"
#include "common/core/lidar_profile.h"

namespace berth::console {

/// A body of the cell as it is drawn.
struct DrawnBody {
  std::string name;
  std::string frame;  ///< in which its mesh stands; "cell" is the fixed one
  std::string kind;   ///< "arm", "replica", "sensor", "cell" or "keepout"
  Mesh mesh;
};

/// Everything of the cell that is drawn.
std::vector<DrawnBody> drawn_bodies(const Cell& cell);

/// The section `scene`.
std::string scene_json(const Cell& cell, const LidarProfile& lidar,
                       const std::vector<DrawnBody>& bodies);

/// The meshes by the paths at which they are served ("/mesh/3"), in the order of the bodies, as
/// PROTOCOL.md has them.
std::map<std::string, std::string> mesh_texts(const std::vector<DrawnBody>& bodies);

/// The section `frames`: every frame that moves, in the cell's frame, as of now. The replica is
/// where truth has it, and where the arms' joints have it while there is no truth; the ghost is
/// where the estimate and its velocity have it by now.
class Frames {
 public:
  /// The cell must outlive it.
  explicit Frames(const Cell& cell);

  void take(const CellMessages& latest);
  Json json(const CellMessages& latest, Utime now) const;

  const Joints& replica_joints() const { return replica_; }
  const Joints& sensor_joints() const { return sensor_; }
  Pose sensor() const { return cell_->sensor.tool_pose(sensor_); }

 private:
  const Cell* cell_;
  Joints replica_;
  Joints sensor_;
};

/// The target in the sensor frame as the estimate has it by now; nothing when there is no good
/// estimate that is young enough to count as current.
std::optional<Pose> estimated_pose(const std::optional<pose_estimate_t>& estimate, Utime now);

}  // namespace berth::console
