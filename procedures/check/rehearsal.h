// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "common/core/lidar_profile.h"
#include "common/core/ray_caster.h"
#include "common/core/run_setup.h"
#include "estimator/estimator_options.h"
#include "procedures/language/procedure.h"
#include "testbed/calibration/calibration.h"
#include "testbed/node/command_planner.h"

namespace berth::procedures {

/// Model of the rig before a run: layout, target and settings, read and built as by the nodes.
struct Rig {
  /// @throws InputError.
  explicit Rig(const RunSetup& run) : Rig(run, testbed::load_calibrated_cell(run)) {}
  Rig(const Rig&) = delete;
  Rig& operator=(const Rig&) = delete;

  RunSetup setup;
  testbed::Calibration calibration;
  Cell cell;
  testbed::Settings settings;
  testbed::Clearance clearance;
  testbed::PathCheck path_check;
  testbed::MotionPlanner planner;
  RayCaster surface;  ///< of the target, model frame
  testbed::CommandPlanner commands;
  estimator::EstimatorOptions estimator;
  LidarProfile lidar;

  testbed::ArmPair home() const { return {cell.replica.home, cell.sensor.home}; }
  /// s from one tracking scan's start to the next one's; returns: 0 for the estimator's own number.
  double scan_period(int returns) const;
  /// s of scanning of an acquisition that succeeds at once.
  double acquisition_time() const;

 private:
  Rig(const RunSetup& run, testbed::CalibratedCell calibrated);
};

/// The rig at one time of a run that goes as planned.
struct Moment {
  double time = 0;  ///< s after the first step's start
  testbed::ArmPair joints;
  Pose pose;             ///< T_sensor_model
  bool tracked = false;  ///< estimates come
  int returns = 0;       ///< per tracking scan; 0: the estimator's own number
};

/// Predicted course of a step.
struct StepForecast {
  std::string name;
  std::string phase;
  int line = 0;
  double start = 0;        ///< s
  double duration = 0;     ///< s
  bool guessed = false;    ///< the procedure does not determine the duration: it is a guess
  bool steered = false;    ///< the place of the arms depends on an outside GNC, now or before
  bool moves = false;      ///< a motion that will be carried out
  std::string refusal;     ///< of its motion: the testbed's text; empty: none
  bool from_afar = false;  ///< checked from the begin of an earlier motion that was refused
  std::optional<std::string> docking_port;  ///< that it approaches; empty: the target's first
  double clearance = 0;                     ///< m, least between two bodies of different parties,
  std::string near_a, near_b;               ///< these; empty: nothing comes near
  double joint_margin = 0;                  ///< rad, least of a rotary joint to its limit
  std::string joint;                        ///< that joint; empty: the arms have none
  std::size_t first_moment = 0, last_moment = 0;  ///< of the rehearsal
  std::string remark;                             ///< assumptions
};

/// Simulates the nominal course of a procedure by computation alone: motions are planned and
/// checked by the testbed's own code, each from the end of the previous one; the estimator is right
/// at once, and the operator gives the answers with which steps pass.
class Rehearsal {
 public:
  Rehearsal(Rig& rig, const testbed::ArmPair& start);

  /// The step after those performed before.
  const StepForecast& perform(const Step& step);

  const std::vector<StepForecast>& steps() const { return steps_; }
  /// At most `spacing` apart, from the first step's start to the last one's end.
  const std::vector<Moment>& moments() const { return moments_; }
  double duration() const { return moments_.back().time; }
  /// Whether a motion was refused, so that the record does not represent a run.
  bool lost_its_way() const { return ever_lost_; }

  static constexpr double spacing = 0.08;  ///< s

 private:
  using Motion = std::shared_ptr<const testbed::ArmMotion>;

  void move(const testbed_command2_t& command, StepForecast& forecast);
  std::variant<Motion, std::string> motion_of(const testbed_command2_t& command);
  void look_around(const testbed::ArmPair& joints, StepForecast& forecast);
  void stay(double duration);

  Rig& rig_;
  testbed::Guidance guidance_;
  testbed::TrajectoryHistory history_;
  Moment now_;
  bool lost_ = false;  // the place of the arms is unknown: the previous motion was refused
  bool ever_lost_ = false;
  bool steered_ = false;  // an outside GNC has steered since the last motion to a commanded pose
  std::vector<Moment> moments_;
  std::vector<StepForecast> steps_;
};

}  // namespace berth::procedures
