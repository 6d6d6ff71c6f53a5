// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "common/bus/loop.h"
#include "common/core/cell.h"
#include "common/core/ray_caster.h"
#include "drivers/simulated/receiver/scene.h"

namespace berth {

/// The true joints of an arm at a time. The LIDAR requests times up to one packet (25 ms) back, in
/// ascending order, never ahead of the loop's clock.
using JointsAt = std::function<Joints(Utime)>;

/// The lamps: the sun far away in a direction of the cell, the albedo all around.
struct SunLamp {
  double level = 0;      ///< 0..1
  double azimuth = 0;    ///< rad about the cell's z, from its x: 0 shines into the sensor
  double elevation = 0;  ///< rad above the horizon
  double albedo = 0;     ///< level of the albedo lamp, 0..1
  /// Unit, to the lamp, cell frame.
  Vector3d towards() const;
};

/// The cell as it truly is: target, mount, both arms and the room, each rigid body with a ray
/// caster of its own that never moves; a ray is brought into the body's frame instead. Left out:
/// the sensor's housing and the sensor arm's last link, which carry the LIDAR and lie behind its
/// aperture, and keep-out volumes, which are invisible.
class CellScene final : public Scene {
 public:
  /// `world` is the true cell: placements, tools, kinematics and meshes as perturbed.
  CellScene(const Cell& world, JointsAt replica, JointsAt sensor,
            const SceneSettings& settings = {});

  using Scene::cast;
  /// At most as many rays as a packet of the ray caster holds.
  void cast(Utime t, std::span<const Ray> rays, double max_range,
            std::span<SceneHit> hits) override;
  void prepare(Utime last) override;
  /// The room occludes no lamp: the lamps are part of it.
  Sunlight sunlight(Utime t) override;

  /// Place of the lamp, read once per packet; none: dark.
  void set_sun_lamp(std::function<SunLamp()> lamp) { sun_lamp_ = std::move(lamp); }
  /// A plate before the target hides this share (0..1) of its width, from the sensor's left.
  void set_occlusion(double share) { occlusion_ = share; }

  /// T_sensor_model, truly, at a time.
  Pose relative_pose(Utime t);

 private:
  struct Body {
    RayCaster caster;
    Vector3d centre;  // of a bounding sphere, and of the bounding box, own frame
    double radius;
    Vector3d half_size;  // of the bounding box
    std::size_t frame;   // of its arm's frames
    bool target;
    std::vector<Material> materials;
    std::vector<std::uint16_t> material_of;  // each triangle; empty: the first
    Vector3d place;                          // of the centre in the cell, now, to some micrometres
    Vector3d place_before = Vector3d::Zero();  // at the knots on both sides of now
    Vector3d place_after = Vector3d::Zero();
    // The sensor in the body's frame, as of the scene's state of that number.
    mutable std::uint64_t seen_in = 0;
    mutable Matrix3d to_body = Matrix3d::Identity();      // from the cell
    mutable Matrix3d sensor_turn = Matrix3d::Identity();  // from the sensor
    mutable Vector3d sensor_place = Vector3d::Zero();
  };
  using Frames = std::array<Pose, 9>;  // in the base: links 0..6 of the arm, its flange, its tool
  /// A rigid group of bodies and its frames.
  struct Group {
    std::vector<Body> bodies;
    Pose base;  // in the cell
    Frames frames;
    Frames next;      // where they move to,
    double done = 0;  // and which share of that way they have come
    Pose frame(std::size_t i) const;
  };
  /// An arm's frames at one time.
  struct Knot {
    Utime time = 0;
    Joints joints{};
    Frames frames;
    bool known = false;
  };
  struct Arm : Group {
    PlacedArm placed;
    JointsAt joints_at;
    Knot before;                       // the requested time lies on it,
    Knot after;                        // or between the two
    bool flange_is_last_link = false;  // true of all arms but perturbed ones
    bool placed_once = false;          // frames are those of `before`
  };

  static constexpr std::size_t last_link = 6;
  static constexpr std::size_t flange_frame = 7;
  static constexpr std::size_t tool_frame = 8;
  static constexpr std::size_t max_rays = 8;

  static Arm make_arm(const PlacedArm& placed, JointsAt joints_at);
  static Body& add(Group& group, const Mesh& mesh, std::size_t frame, const Material& material);
  static void find_knot(const Arm& arm, Utime t, Knot& knot);
  /// @param next the farthest time that it may look ahead to
  /// @return false when it has not moved.
  static bool move(Arm& arm, Utime t, Utime next);
  void move_to(Utime t);
  /// First hit of a ray of the sensor frame: the body, and the normal in the sensor frame.
  struct Met {
    double range;
    const Body* body;
    std::uint32_t triangle;
    Vector3d normal;
  };
  /// Brings the sensor into a body's frame, unless it is there.
  void see_from(const Group& group, const Body& body) const;
  /// Rays of one beam, sensor frame. met: keeps the nearer hit.
  void cast_at(const Group& group, std::span<const Ray> rays, std::span<Met> met) const;
  bool meets_plate(const Pose& sensor, const Vector3d& direction, double range,
                   SceneHit& hit) const;

  Arm replica_;
  Arm sensor_;
  Group room_;
  std::function<SunLamp()> sun_lamp_;
  double occlusion_ = 0;
  double target_reach_ = 0;                      // m of its farthest point from its origin
  Pose sensor_pose_;                             // in the cell, now
  Matrix3d sensor_turn_ = Matrix3d::Identity();  // its rotation
  bool moved_ = false;
  std::uint64_t state_ = 1;  // another number after every motion
  Utime time_ = 0;
  Utime prepared_until_ = 0;
};

}  // namespace berth
