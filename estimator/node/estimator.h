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

/// Where an Estimator puts what it has to say.
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

/// What an Estimator is made from.
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
/// scan requests, as a fold over its inputs: the same packets and commands give the same numbers.
/// It has no clock and no timer; everything it says follows from the last thing it was told.
///
/// Scans are numbered. A command names the first scan to which it applies and is obeyed just before
/// that scan, or the first after it, is asked for; an idle estimator obeys at once. A scan is used
/// when its last packet, or a packet of a later scan, is there.
class Estimator {
 public:
  /// @throws InputError when the first model cannot be had.
  Estimator(EstimatorSetup setup, EstimatorOutput& output);

  void take(const ScanPacket& packet);
  void take(const estimator_command_t& command);
  /// Where the options want it. What comes later than the scan in whose time it falls was used is
  /// of no use any more; the diagnostics tell how much was there (inertial_s).
  void take(const inertial_motion_t& motion);

  /// Says the state, also when nothing changed.
  void announce();
  const estimator_state_t& state() const { return said_; }

 private:
  using Mode = estimator_state_t;

  struct Instructions {  // of the commands obeyed so far
    std::int8_t mode = estimator_state_t::IDLE;
    std::int64_t session = 0;
    std::int64_t command_seq = 0;
    RangeGate gate;
    ScanStrategy strategy = ScanStrategy::corners_sparse;
    int returns_per_scan = 0;
    int acquire_returns = 0;  // wanted of the scan in which the target is found; 0: as they come
  };
  struct Pending {  // accepted, for a later scan
    estimator_command_t command{};
    std::shared_ptr<const TargetModel> model;  // of CHOOSE_MODEL
  };
  struct Scan {  // asked for and not yet finished
    std::int64_t id = 0;
    bool own_windows = false;  // a procedure's SCAN
    bool held_back = false;    // goes out when the LIDAR is heard of again
    scan_request_t request{};
    std::map<std::int32_t, ScanPacket> packets;
  };
  struct Bundle {  // a finished scan
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
    std::optional<TrackingResult> measured;  // a pose that holds
  };
  struct Stream {                            // of the scan that is running, when streaming
    std::unique_ptr<TargetTracker> tracker;  // as far as its returns go; forgotten at its end
    int next_packet = 0;
    std::vector<RawBeam> beams;  // so far
    int returns = 0;             // since the last estimate
    bool doubtful = false;       // the scan contradicts the prediction: no more estimates of it
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
  void obey(const Pending& pending);
  int usual_returns() const;
  void obey_commands_up_to(std::int64_t scan_id);

  // Scans
  void proceed(bool hold_back);
  std::vector<Window> plan_windows();
  void ask_for(std::vector<scan_window_t> windows, const std::string& purpose, bool own_windows,
               bool hold_back);
  void publish_request();
  void finish_scan();
  Bundle bundle(const Scan& scan) const;

  // Estimates
  void process(const Bundle& bundle);
  bool streams() const {
    return setup_.options.streaming && setup_.options.tracker_method == "se3";
  }
  void stream();
  void track_so_far(Stream& stream);
  void publish_streamed(Stream& stream, const TargetTracker& tracker,
                        const TrackingResult& measured, pose_estimate_t& estimate,
                        std::int64_t start);
  pose_estimate_t blank_estimate(std::int64_t scan_id, const CleanScan& scan) const;
  void acquire(const CleanScan& scan, pose_estimate_t& estimate, Durations& durations);
  void track(const CleanScan& scan, pose_estimate_t& estimate, Durations& durations);
  void acquire_far(const LongRangeFix& far, bool was_zoomed, const CleanScan& scan,
                   pose_estimate_t& estimate);
  void search_more_finely(bool met_something);
  Found find_pose(const CleanScan& scan, const Velocity& velocity, pose_estimate_t& estimate);
  TrackingResult measure(const CleanScan& scan, const Prediction& predicted);
  static Prediction predicted_by(const TargetTracker& tracker, std::int64_t utime);
  void tell_noise();
  void track_far(const CleanScan& scan, pose_estimate_t& estimate, Durations& durations);
  void take_far(const LongRangeFix& far, pose_estimate_t& estimate);
  void start_from(const Pose& pose, const Matrix6d& covariance, std::int64_t utime);
  void forget_target();
  static constexpr char not_filtered[] =
      "the filter could not take the measured pose in: not finite, or a singular covariance";
  static double largest_sigma(const Matrix3d& covariance);
  static Matrix6d resumed_covariance();
  FieldOfView field_of_view() const;
  /// Around the target in this pose, for the next acquisition scan.
  std::vector<Window> look_closer(const Pose& pose, double margin) const;
  void look_at(std::vector<Window> windows, const std::vector<Pose>& poses);
  ModelSphere whole_target(double margin) const;
  void count_failure(const std::string& reason);
  void fill_filtered(pose_estimate_t& estimate) const { fill_filtered(*tracker_, estimate); }
  void fill_filtered(const TargetTracker& tracker, pose_estimate_t& estimate) const;
  void use_model(std::shared_ptr<const TargetModel> model);
  void change_mode(std::int8_t mode, const std::string& reason);
  void say_state();

  EstimatorSetup setup_;
  EstimatorOutput& output_;
  std::shared_ptr<const TargetModel> model_;
  NoiseScale noise_;  // before what measures with it
  bool noise_told_ = false;
  std::unique_ptr<Acquisition> acquisition_;
  std::unique_ptr<Tracking> tracking_;
  std::unique_ptr<ScanPlanner> planner_;
  std::unique_ptr<TargetTracker> tracker_;
  SensorMotions sensor_motions_;
  std::unique_ptr<RangeSwitch> ranges_;
  std::unique_ptr<LongRange> long_range_;

  Instructions now_;
  std::deque<Pending> pending_;
  std::deque<std::vector<scan_window_t>> own_scans_;  // a procedure's, to be asked for next
  std::map<std::pair<std::int64_t, std::string>, std::int64_t>
      heard_;  // last seq of each commander
  std::optional<Scan> scan_;
  std::optional<Stream> stream_;
  std::int64_t last_id_ = 0;      // asked for, or seen
  std::int64_t finished_id_ = 0;  // used, or passed over
  std::int64_t last_input_utime_ = 0;
  std::int64_t last_beam_utime_ = 0;
  int failures_ = 0;               // tracking scans in a row
  std::vector<Hypothesis> hints_;  // what the last acquisition scan left open
  std::vector<Window> zoom_;       // where the next acquisition scan looks; empty: everywhere
  int looks_ = 0;                  // of those in a row, that were scanned
  int searches_ = 0;  // of the whole field of view in a row that met something and found nothing
  int search_beams_ = 0;  // of a scan of the whole field of view
  OperatingRange range_ = OperatingRange::medium_range;
  bool within_reach_ = false;  // in long range, and near enough for the pose
  Quaterniond far_attitude_ = Quaterniond::Identity();  // the last scan's, in long range
  Matrix6d systematic_ = Matrix6d::Zero();              // beside the filter's, in long range

  estimator_state_t state_{};
  std::string mode_reason_;
  estimator_state_t said_{};  // last published
  std::int64_t request_seq_ = 0;
  std::int64_t estimate_seq_ = 0;
};

}  // namespace berth::estimator
