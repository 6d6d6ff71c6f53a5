// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "common/core/cell.h"
#include "common/core/ray_caster.h"
#include "drivers/simulated/scene.h"

namespace berth {

/// The true joints of an arm at a time. The LIDAR asks for times up to one packet (25 ms) back, in
/// ascending order, never ahead of the loop's clock.
using JointsAt = std::function<Joints(Utime)>;

struct SceneSettings {
  double target_reflectivity = 0.5;
  double mount_reflectivity = 0.3;
  double arm_reflectivity = 0.3;
  double room_reflectivity = 0.6;
};

/// The cell as it truly is: target, mount, both arms and the room, each rigid body with a ray
/// caster of its own that never moves; a ray is brought into the body's frame instead. Left out:
/// the sensor's housing and the sensor arm's last link, which carry the LIDAR and lie behind its
/// aperture, and keep-out volumes, which are not there to be seen.
class CellScene final : public Scene {
 public:
  /// `world` is what really stands there: placements, tools, kinematics and meshes as perturbed.
  CellScene(const Cell& world, JointsAt replica, JointsAt sensor,
            const SceneSettings& settings = {});

  bool cast(Utime t, const Vector3d& direction, double max_range, SceneHit& hit) override;
  /// T_sensor_model, truly, at a time.
  Pose relative_pose(Utime t);

 private:
  struct Body {
    RayCaster caster;
    Vector3d centre;  // of a bounding sphere, own frame
    double radius;
    double reflectivity;
    int link;  // of its arm
    bool target;
    // Where it is now:
    Vector3d cell_centre;
    Vector3d position;
    Matrix3d to_body;
  };
  struct Arm {
    PlacedArm placed;
    JointsAt joints;
    Joints now{};
    bool known = false;  // now is of the time last asked for
    std::vector<Body> bodies;
    Pose tool;  // in the cell
  };

  static constexpr int flange_link = 7;
  static constexpr int tool_link = 8;
  static constexpr int room_link = 9;

  static void add(std::vector<Body>& bodies, const Mesh& mesh, int link, double reflectivity,
                  bool target = false);
  static void place(Body& body, const Pose& pose);
  static void move(Arm& arm, Utime t);
  void move_to(Utime t);
  static void cast_at(const std::vector<Body>& bodies, const Ray& ray, double& nearest,
                      const Body*& met, RayHit& hit);

  Arm replica_;
  Arm sensor_;
  std::vector<Body> room_;
  bool moved_ = false;
  Utime time_ = 0;
};

}  // namespace berth
