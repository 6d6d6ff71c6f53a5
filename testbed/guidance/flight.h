// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <variant>

#include "testbed/guidance/approach_axis.h"
#include "testbed/guidance/chaser.h"
#include "testbed/guidance/guidance.h"

namespace berth::testbed {

/// Closed-loop flight by a guidance profile: an approach down a corridor to a standoff, or station
/// keeping. Frame N is the target's frame at the start of the flight; the chaser's pose in N
/// follows from its own commands. An estimate is referred to the command that was executed when its
/// scan was made (dead time, scan time and computation lie in between) and so gives the target's
/// pose and velocity in N. Guidance flies by the newest estimate, extrapolated at constant velocity
/// to the time at which the next command takes effect. Estimates are not filtered here: that is the
/// estimator's task.
class Flight final : public Steering {
 public:
  struct Order {
    bool keep = false;  ///< a pose, instead of an approach
    Pose pose;          ///< to keep, T_sensor_model
    double standoff = 0;
    bool dock = false;  ///< standoff and ranges are of the docking interface
    RelativeLimits limits;
  };
  using Result = std::variant<std::shared_ptr<Flight>, std::string>;

  /// Begins at the pose commanded now. @return the flight, or why there can be none.
  static Result begin(const GuidanceProfile& profile, const ApproachTarget& target,
                      const Guidance::Settings& settings, const Order& order, std::int64_t now,
                      const Pose& commanded, const PoseHistory& before,
                      const std::optional<Estimate>& estimate);

  void on_estimate(const Estimate& estimate) override;
  Output step(std::int64_t now, double dt) override;
  GuidanceReport report() const override { return report_; }
  double remaining() const override { return std::max(0.0, expected_ - time_); }
  /// Sets the forecast duration, s.
  void expect(double duration) { expected_ = duration; }
  bool keeps() const { return order_.keep; }
  /// T_sensor_model, had the target not moved by itself.
  Pose commanded() const { return chaser_.pose().inverse(); }
  /// T_N_model by the estimate at the start.
  const Pose& first_target_pose() const { return first_target_pose_; }

 private:
  using Phase = GuidanceReport::Phase;

  struct Command {
    double time = 0;  // of flight
    Pose pose;        // T_N_sensor
  };
  friend Command blend(const Command& a, const Command& b, double s) {
    return {a.time + s * (b.time - a.time), interpolate(a.pose, b.pose, s)};
  }

  /// The target in frame N at a time of flight; its velocity in a second of flight.
  struct TargetState {
    double time = 0;
    Pose pose;
    Velocity velocity;
    Pose at(double t) const { return moved(pose, velocity, t - time); }
  };

  Flight(const GuidanceProfile& profile, const ApproachTarget& target,
         const Guidance::Settings& settings, const Order& order, std::int64_t now,
         const Pose& commanded, const PoseHistory& before, const Estimate& estimate);

  std::string refusal() const;
  TargetState target_state(const Estimate& estimate, const TargetState* last) const;
  std::string interruption(std::int64_t now) const;
  void update_phase(std::int64_t now, double dt, const Pose& model);
  double reference_closing(double to_go) const;
  void proceed(double dt);
  void wait_at_hold_point(double dt);
  void settle();
  void fly(double dt, const Pose& model);
  void start_retreat(const std::string& reason);
  void retreat(double dt);
  void update_report(const Pose& model);

  GuidanceProfile profile_;
  Guidance::Settings settings_;
  Order order_;
  Chaser chaser_;
  CommandHistory<Command> commands_;
  Estimate estimate_;
  TargetState target_state_;  // by the last estimate that was accepted
  Pose first_target_pose_;    // T_N_model
  ApproachAxis axis_;
  std::vector<GuidanceProfile::HoldPoint> stops_;  // still ahead
  int passed_stops_ = 0;                           // of the profile's

  double time_ = 0;      // of flight, s
  double expected_ = 0;  // of flight, s
  Phase phase_ = Phase::approaching;
  std::string reason_;
  double along_ = 0;  // reference, m from the aim point
  double closing_ = 0;
  double closing_rate_ = 0;
  ApproachAxis::Place place_;
  double misalignment_ = 0;
  double corridor_ = -1;  // half width here
  bool in_corridor_ = false;
  double waiting_ = 0;          // s for the conditions of going on
  double dwelt_ = 0;            // s within them
  double interrupted_for_ = 0;  // s
  int good_in_a_row_ = 0;
  std::string rejection_;
  std::optional<double> arrived_;  // time of flight
  bool done_ = false;
  bool aborted_ = false;

  Vector3d retreat_out_ = Vector3d::Zero();  // frame N
  Pose retreat_model_;                       // where the target was last
  Vector3d burn_ = Vector3d::Zero();         // still to come, m/s
  double retreat_time_ = 0;
  GuidanceReport report_;
};

}  // namespace berth::testbed
