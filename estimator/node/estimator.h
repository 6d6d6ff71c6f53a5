// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/estimator_command_t.hpp>
#include <berth/estimator_diagnostics_t.hpp>
#include <berth/estimator_state_t.hpp>
#include <berth/inertial_motion_t.hpp>
#include <berth/pose_estimate_t.hpp>
#include <berth/scan_request_t.hpp>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>

#include "common/core/lidar_profile.h"
#include "estimator/estimator_options.h"
#include "estimator/filter/target_tracker.h"
#include "estimator/plan/operating_range.h"
#include "estimator/track/long_range.h"
#include "lcmtypes/scan_packet.h"

namespace berth::estimator {

/// Receives an Estimator's output.
class EstimatorOutput {
 public:
  virtual ~EstimatorOutput() = default;
  virtual void request(const scan_request_t& message) = 0;
  virtual void estimate(const pose_estimate_t& message) = 0;
  virtual void state(const estimator_state_t& message) = 0;
  virtual void diagnostics(const estimator_diagnostics_t& message) = 0;
  /// severity: event_t::INFO ... FATAL.
  virtual void note(std::int8_t severity, const std::string& code, const std::string& text) = 0;
};

/// Arguments of an Estimator.
struct EstimatorSetup {
  EstimatorOptions options;
  LidarProfile lidar;
  std::string target;        ///< the first model's name
  std::int64_t session = 0;  ///< until a command names one
  /// Finds a model by name or path. @throws InputError.
  std::function<std::shared_ptr<const TargetModel>(const std::string& target)> find_model;
  /// Microseconds of a clock that only measures durations, for the diagnostics.
  std::function<std::int64_t()> stopwatch;
};

/// The pose estimator (paper, Figure 3): preprocessing, acquisition, tracking, target tracker and
/// scan requests, as a fold over its inputs: equal packets and commands give equal output. It has
/// no clock and no timer; output follows from inputs only.
///
/// Scans are numbered. A command names the first scan to which it applies and is executed before
/// that scan, or the first after it, is requested; when idle, at once. A scan is processed when its
/// last packet, or a packet of a later scan, has arrived.
class Estimator {
 public:
  /// @throws InputError when the first model is not available.
  Estimator(EstimatorSetup setup, EstimatorOutput& output);

  void receive(const ScanPacket& packet);
  void receive(const estimator_command_t& command);
  /// If the options enable it. Motion that arrives after its scan was processed is not used; the
  /// diagnostics give the time covered (inertial_s).
  void receive(const inertial_motion_t& motion);

  /// Publishes the state, changed or not.
  void publish_state();
  const estimator_state_t& state() const { return published_; }

 private:
  using Mode = estimator_state_t;

  struct Instructions {  // by executed commands
    std::int8_t mode = estimator_state_t::IDLE;
    std::int64_t session = 0;
    std::int64_t command_seq = 0;
    RangeGate gate;
    ScanStrategy strategy = ScanStrategy::corners_sparse;
    int returns_per_scan = 0;
    int acquire_returns = 0;  // required of the scan that acquires the target; 0: no requirement
  };
  struct PendingCommand {  // accepted, for a later scan
    estimator_command_t command{};
    std::shared_ptr<const TargetModel> model;  // of CHOOSE_MODEL
  };
  struct Scan {  // requested and not finished
    std::int64_t id = 0;
    bool own_windows = false;  // a procedure's SCAN
    bool held_back = false;    // until the LIDAR sends again
    scan_request_t request{};
    std::map<std::int32_t, ScanPacket> packets;
  };
  struct FinishedScan {  // a finished scan
    std::int64_t id = 0;
    bool own_windows = false;
    std::int8_t status = 0;
    std::string reason;
    int first_packet = 0;
    int last_packet = -1;
    int packets_missing = 0;
    std::vector<RawBeam> beams;
    std::int64_t utime = 0;  // of the last beam, or of the end
  };
  struct Found {  // by acquisition
    AcquisitionResult::Status status = AcquisitionResult::Status::not_found;
    std::vector<Hypothesis> hypotheses;
    std::optional<TrackingResult> measured;  // a validated pose
  };
  struct Stream {                            // state of streaming during a scan
    std::unique_ptr<TargetTracker> tracker;  // a copy, updated by the returns so far
    int next_packet = 0;
    std::vector<RawBeam> beams;  // so far
    int returns = 0;             // since the last estimate
    bool inconsistent = false;   // with the prediction: no further estimates of this scan
  };
  struct Durations {
    std::int64_t preprocess = 0;
    std::int64_t acquire = 0;
    std::int64_t track = 0;
    std::int64_t plan = 0;
  };

  // Commands
  std::string refusal_of(const estimator_command_t& command,
                         std::shared_ptr<const TargetModel>& model) const;
  void execute(const PendingCommand& pending);
  int default_returns() const;
  void execute_commands_up_to(std::int64_t scan_id);

  // Scans
  void start_next_scan(bool hold_back);
  std::vector<Window> plan_windows();
  void request_scan(std::vector<scan_window_t> windows, const std::string& purpose,
                    bool own_windows, bool hold_back);
  void publish_request();
  void finish_scan();
  FinishedScan finished_scan(const Scan& scan) const;

  // Estimates
  void process(const FinishedScan& finished_scan);
  bool streams() const {
    return setup_.options.streaming && setup_.options.tracker_method == "se3";
  }
  void stream();
  void track_partial_scan(Stream& stream);
  void publish_streamed(Stream& stream, const TargetTracker& tracker,
                        const TrackingResult& measured, pose_estimate_t& estimate,
                        std::int64_t start);
  pose_estimate_t new_estimate(std::int64_t scan_id, const PreprocessedScan& scan) const;
  void acquire(const PreprocessedScan& scan, pose_estimate_t& estimate, Durations& durations);
  void track(const PreprocessedScan& scan, pose_estimate_t& estimate, Durations& durations);
  void acquire_far(const LongRangeFix& far, bool was_zoomed, const PreprocessedScan& scan,
                   pose_estimate_t& estimate);
  void densify_search(bool met_something);
  Found find_pose(const PreprocessedScan& scan, const Velocity& velocity,
                  pose_estimate_t& estimate);
  TrackingResult measure(const PreprocessedScan& scan, const Prediction& predicted);
  static Prediction prediction_of(const TargetTracker& tracker, std::int64_t utime);
  void report_noise();
  void track_far(const PreprocessedScan& scan, pose_estimate_t& estimate, Durations& durations);
  void accept_far(const LongRangeFix& far, pose_estimate_t& estimate);
  void start_from(const Pose& pose, const Matrix6d& covariance, std::int64_t utime);
  void forget_target();
  static constexpr char not_filtered[] =
      "the filter could not take the measured pose in: not finite, or a singular covariance";
  static double largest_sigma(const Matrix3d& covariance);
  static Matrix6d resumed_covariance();
  FieldOfView field_of_view() const;
  /// Windows about the target in this pose, for the next acquisition scan.
  std::vector<Window> zoom_windows(const Pose& pose, double margin) const;
  void set_zoom(std::vector<Window> windows, const std::vector<Pose>& poses);
  ModelSphere whole_target(double margin) const;
  void count_failure(const std::string& reason);
  void fill_filtered(pose_estimate_t& estimate) const { fill_filtered(*tracker_, estimate); }
  void fill_filtered(const TargetTracker& tracker, pose_estimate_t& estimate) const;
  void use_model(std::shared_ptr<const TargetModel> model);
  void change_mode(std::int8_t mode, const std::string& reason);
  void publish_changed_state();

  EstimatorSetup setup_;
  EstimatorOutput& output_;
  std::shared_ptr<const TargetModel> model_;
  NoiseScale noise_;  // declared before its users
  bool noise_reported_ = false;
  std::unique_ptr<Acquisition> acquisition_;
  std::unique_ptr<Tracking> tracking_;
  std::unique_ptr<ScanPlanner> planner_;
  std::unique_ptr<TargetTracker> tracker_;
  SensorMotions sensor_motions_;
  std::unique_ptr<RangeSwitch> ranges_;
  std::unique_ptr<LongRange> long_range_;

  Instructions now_;
  std::deque<PendingCommand> pending_;
  std::deque<std::vector<scan_window_t>> own_scans_;  // a procedure's, to be requested next
  std::map<std::pair<std::int64_t, std::string>, std::int64_t>
      last_seqs_;  // last seq of each commander
  std::optional<Scan> scan_;
  std::optional<Stream> stream_;
  std::int64_t last_id_ = 0;      // requested or received
  std::int64_t finished_id_ = 0;  // processed or skipped
  std::int64_t last_input_utime_ = 0;
  int failures_ = 0;               // tracking scans in a row
  std::vector<Hypothesis> hints_;  // undecided hypotheses of the last acquisition scan
  std::vector<Window> zoom_;       // of the next acquisition scan; empty: the whole field of view
  int zoom_scans_ = 0;             // in a row
  int searches_ = 0;      // of the whole field of view in a row with returns and without a target
  int search_beams_ = 0;  // of a scan of the whole field of view
  OperatingRange range_ = OperatingRange::medium_range;
  bool near_enough_ = false;  // in long range, and near enough for the pose
  Quaterniond coarse_attitude_ = Quaterniond::Identity();  // of the last scan, in long range
  Matrix6d systematic_ = Matrix6d::Zero();  // added to the filter's covariance, in long range

  estimator_state_t state_{};
  std::string mode_reason_;
  estimator_state_t published_{};  // last published
  std::int64_t request_seq_ = 0;
  std::int64_t estimate_seq_ = 0;
};

}  // namespace berth::estimator
