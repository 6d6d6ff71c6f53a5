// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>

#include "common/core/pose.h"
#include "common/core/ray_caster.h"
#include "common/targets/target.h"
#include "testbed/guidance/steering.h"
#include "testbed/motion/command_history.h"
#include "testbed/motion/motion_profile.h"
#include "testbed/motion/relative_path.h"

namespace berth::testbed {

/// End of an approach to a docking interface, in place of the nearest surface: a point of the
/// target, model frame, at a place in the sensor frame.
struct Docking {
  DockingPort port;
  Vector3d place = Vector3d::Zero();
};

/// Closed-loop guidance without a profile, by the estimate alone. It streams commanded relative
/// poses: either along the boresight until the nearest surface of the target is at the standoff,
/// with the attitude and the lateral offset of the start; or straight to the pose at which the
/// docking interface is at its place, with the attitude of the start. An estimate is propagated to
/// the present by the commands since a dead time before its stamp; the resulting correction is
/// applied to the command at a limited rate. Arms, joints and ground truth are unknown here.
class Guidance {
 public:
  struct Settings {
    std::int64_t stale_after = 3000000;        ///< us: an older estimate holds the motion
    std::int64_t give_up_after = 30000000;     ///< us of holding
    std::int64_t settle_for = 10000000;        ///< us to wait at the end for the estimate to agree
    double settle_tolerance = 0.02;            ///< m from the standoff
    int good_estimates = 2;                    ///< in a row, to go on after a hold
    double correction_speed = 0.01;            ///< m/s
    double correction_angular_speed = 0.017;   ///< rad/s
    double largest_correction = 0.25;          ///< m, or, at long range,
    double largest_correction_share = 0.01;    ///< of the range; and
    double largest_angular_correction = 0.26;  ///< rad; beyond, the estimate is rejected
    double hold_settling = 0.8;                ///< s to come to rest

    /// m, the largest correction for which an estimate is accepted.
    double correction_limit(const Pose& estimate) const {
      return std::max(largest_correction, largest_correction_share * estimate.position.norm());
    }
  };
  enum class Phase { flying, holding, settling, done, gave_up };
  struct Output {
    Pose commanded;  ///< T_sensor_model
    Phase phase = Phase::flying;
    std::string reason;  ///< of holding or giving up
    double progress = 0;
  };

  /// target: in the model frame; must outlive this.
  Guidance(const RayCaster& target, const Settings& settings)
      : target_(&target), settings_(settings), scale_(settings.hold_settling) {}

  void on_estimate(const Estimate& estimate);
  const std::optional<Estimate>& estimate() const { return estimate_; }
  /// Recent commands.
  const PoseHistory& history() const { return history_; }
  /// The target has moved by itself, to this pose in its frame before; at rest again.
  void note_target_moved(const Pose& moved);
  GuidanceReport report() const;
  /// Age of the last estimate, us; nothing before the first.
  std::optional<std::int64_t> estimate_age(std::int64_t now) const;

  /// Begins an approach from the pose commanded now. @return why it cannot, or nothing.
  std::optional<std::string> approach(std::int64_t now, const Pose& commanded, double standoff,
                                      const RelativeLimits& limits,
                                      const std::optional<Docking>& docking = std::nullopt);
  /// Begins to keep a pose by the estimate. @return why it cannot, or nothing.
  std::optional<std::string> keep(std::int64_t now, const Pose& commanded, const Pose& reference,
                                  const RelativeLimits& limits);
  /// Continues as a copy of this that has begun a motion; estimates and commanded poses received
  /// here meanwhile are kept.
  void continue_as(Guidance begun);
  /// Where the motion will end if the estimate does not change; for the check before it starts.
  Pose predicted_end() const { return uncorrected(reference(travel_.length())); }
  /// Distance of the estimate from the commanded pose at the start: m and rad.
  double initial_distance() const { return offset_.position.norm(); }
  double initial_angle() const { return angle_between(offset_, Pose()); }

  /// A hold from outside: at rest on the path as long as it lasts. After it, the time-out of a lost
  /// estimate begins anew.
  void set_held(bool held);
  /// Ends steering; estimates and commanded poses are still recorded.
  void stop();
  double progress() const;
  double remaining() const;  ///< s, as planned
  bool at_rest() const { return scale_.at_rest(); }
  void set_override(double rate) { override_ = rate; }
  /// Records the commands of another source.
  void note_commanded(std::int64_t now, const Pose& commanded) { history_.add(now, commanded); }
  Output step(std::int64_t now, double dt);

 private:
  std::optional<std::string> begin(std::int64_t now, const Pose& commanded);
  std::string unusable(std::int64_t now) const;
  void correct(const Estimate& estimate);
  Pose reference(double travelled) const;
  Pose uncorrected(const Pose& reference) const;
  Pose seen_from(const Pose& commanded, const Estimate& estimate) const;
  double surface_distance(const Pose& pose) const;
  /// How far the end of the approach is from a pose, m.
  double distance_to_go(const Pose& pose) const;

  const RayCaster* target_;
  Settings settings_;
  TimeScale scale_;
  std::optional<Estimate> estimate_;
  int good_in_a_row_ = 0;
  PoseHistory history_;

  bool active_ = false;
  bool keeping_ = false;
  bool held_ = false;
  double override_ = 1;
  Pose reference_start_;                     // by the estimate
  SmoothTravel travel_;                      // along the direction
  Vector3d direction_ = -Vector3d::UnitZ();  // of the approach, unit, sensor frame
  std::optional<Docking> docking_;
  double standoff_ = 0;
  double time_ = 0;  // along the travel
  // Estimates of the target, in the model frame of the commanded pose.
  Pose offset_;
  Pose seen_;                       // by the last estimate; offset_ slews to it
  std::int64_t holding_since_ = 0;  // 0: not holding
  std::int64_t arrived_ = 0;        // 0: not yet
  std::string reason_;              // of holding
};

}  // namespace berth::testbed
