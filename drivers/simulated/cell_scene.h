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

/// A property of each kind of surface, 0..1.
struct SurfaceShares {
  double target = 0;
  double mount = 0;
  double arm = 0;
  double room = 0;
};

struct SceneSettings {
  SurfaceShares reflectivity{0.5, 0.3, 0.3, 0.6};
  SurfaceShares specular{0.3, 0, 0, 0};  ///< of sunlight, as by a mirror
};

/// The sun lamp: far away in a direction of the cell.
struct SunLamp {
  double level = 0;      ///< 0..1
  double azimuth = 0;    ///< rad about the cell's z, from its x: 0 shines into the sensor
  double elevation = 0;  ///< rad above the horizon
  /// Unit, to the lamp, cell frame.
  Vector3d towards() const;
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
  /// The room hides no lamp: it is the room's.
  Sunlight sunlight(Utime t) override;

  /// Where the lamp is, asked once per packet; none: dark.
  void set_sun_lamp(std::function<SunLamp()> lamp) { sun_lamp_ = std::move(lamp); }
  /// A plate before the target hides this share (0..1) of its width, from the sensor's left.
  void set_occlusion(double share) { occlusion_ = share; }

  /// T_sensor_model, truly, at a time.
  Pose relative_pose(Utime t);

 private:
  struct Body {
    RayCaster caster;
    Vector3d centre;  // of a bounding sphere, own frame
    double radius;
    double reflectivity;
    double specular;
    std::size_t frame;  // of its arm's frames
    bool target;
    Vector3d place;  // of the centre in the base, now
  };
  /// What moves together, and the frames in which its bodies stand.
  struct Group {
    std::vector<Body> bodies;
    Pose base;                   // in the cell
    std::array<Pose, 9> frames;  // in the base: links 0..6 of the arm, its flange, its tool
  };
  struct Arm : Group {
    PlacedArm placed;
    JointsAt joints_at;
    Joints joints{};
    bool placed_once = false;
    bool flange_is_last_link = false;  // true of all arms but perturbed ones
  };

  static constexpr std::size_t last_link = 6;
  static constexpr std::size_t flange_frame = 7;
  static constexpr std::size_t tool_frame = 8;

  static Arm make_arm(const PlacedArm& placed, JointsAt joints_at);
  static void add(Group& group, const Mesh& mesh, std::size_t frame, double reflectivity,
                  double specular, bool target = false);
  /// @return false when it stands where it stood.
  static bool move(Arm& arm, Utime t);
  void move_to(Utime t);
  /// What a ray of the cell frame meets first: the body, and the normal in the cell frame.
  struct Met {
    double range;
    const Body* body = nullptr;
    Vector3d normal = Vector3d::Zero();
  };
  static void cast_at(const Group& group, const Ray& ray, Met& met);
  bool meets_plate(const Pose& sensor, const Vector3d& direction, double range,
                   SceneHit& hit) const;

  Arm replica_;
  Arm sensor_;
  Group room_;
  std::function<SunLamp()> sun_lamp_;
  double occlusion_ = 0;
  double target_reach_ = 0;  // m of its farthest point from its origin
  Pose sensor_pose_;         // in the cell, now
  bool moved_ = false;
  Utime time_ = 0;
};

}  // namespace berth
