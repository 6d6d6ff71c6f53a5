// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <berth/estimator_command_t.hpp>
#include <berth/estimator_state_t.hpp>
#include <berth/pose_estimate_t.hpp>
#include <berth/scan_request_t.hpp>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/lidar_profile.h"
#include "common/core/run_setup.h"
#include "common/targets/target.h"
#include "estimator/estimator_options.h"
#include "estimator/node/estimator_plugin.h"
#include "estimator/node/messages.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/conversions.h"

namespace berth::estimator {

/// A pose measured in one scan.
struct ScanPose {
  Pose pose;            ///< T_sensor_model
  Matrix6d covariance;  ///< as perturbed(): [m; rad], sensor frame; positive definite
  int returns = 0;      ///< used
};

/// The messages of an estimator of one's own, which takes one scan after another; a method derives
/// from it. It receives SCAN_DATA and ESTIMATOR_COMMAND (STOP, ACQUIRE, TRACK); publishes
/// SCAN_REQUEST, a POSE_ESTIMATE for each scan, and ESTIMATOR_STATE. Scans cover the field of view
/// until the target is found, and then its surroundings. Velocities are not estimated. All calls
/// come on the loop. Defined here, so that a library for the twin carries it.
class ScanEstimator : public Node {
 public:
  ScanEstimator(NodeSetup setup, const RunSetup& run, Bus& the_bus, Loop& the_loop)
      : Node(std::move(setup), the_bus, the_loop),
        options_(load_estimator_options(run.config / "estimator.yaml")),
        lidar_(load_lidar_profile(run, options_.lidar)),
        model_(load_target_model(load_target(run.target, run.target_length), options_.model,
                                 default_cache_directory())),
        acquisition_(make_acquisition(options_, *model_, lidar_.beam)),
        planner_(*model_,
                 {lidar_.field_of_view_width, lidar_.field_of_view_height, lidar_.minimum_step_rad,
                  lidar_.beam},
                 options_.planner) {
    state_.session = request_.session = session();
    bus().subscribe<ScanPacket>(channels::scan_data, Queue::fifo(4000),
                                [this](const ScanPacket& packet) { take(packet); });
    bus().subscribe<estimator_command_t>(channels::estimator_command, Queue::fifo(),
                                         [this](const estimator_command_t& c) { take(c); });
    timer_ = loop().every(second, [this] {  // for those that join late, and for a lost request
      publish_state();
      if (state_.mode != Mode::IDLE) request_scan();
    });
    report(node_status_t::READY);
  }
  ~ScanEstimator() override { loop().cancel(timer_); }

 protected:
  /// Name of the method, in each estimate.
  virtual std::string method() const = 0;
  /// @param last T_sensor_model in the scan before; nothing: the target is to be acquired
  /// @return nothing: lost
  virtual std::optional<ScanPose> estimate(const PreprocessedScan& scan,
                                           const std::optional<Pose>& last) = 0;

  const TargetModel& model() const { return *model_; }
  /// T_sensor_model by Berth's acquisition; nothing: not found, or ambiguous.
  std::optional<Pose> acquire(const PreprocessedScan& scan) const {
    const AcquisitionResult result = acquisition_->acquire(scan);
    if (result.status != AcquisitionResult::Status::found) return std::nullopt;
    return result.hypotheses.front().pose;
  }

 private:
  using Command = estimator_command_t;
  using Mode = estimator_state_t;

  /// A repeated command changes nothing, but is answered again.
  void take(const Command& command) {
    if (command.session != session()) return;
    if (command.seq > std::max(state_.command_seq, state_.refused_seq)) {
      const bool tracks = command.command == Command::TRACK;
      if (command.command > Command::TRACK || (tracks && !pose_)) {
        state_.refused_seq = command.seq;
        state_.reason = tracks ? "acquire first" : "expected STOP, ACQUIRE or TRACK";
      } else {
        state_.command_seq = command.seq;
        state_.mode = tracks ? Mode::TRACKING : command.command;  // 0: IDLE, 1: ACQUIRING
        if (!tracks) pose_.reset();
        if (command.gate_far_m > 0) gate_ = {command.gate_near_m, command.gate_far_m};
        if (state_.mode != Mode::IDLE && !scanning_) request_scan();
      }
    }
    publish_state();
  }

  /// Requests the next scan, or the one under way again.
  void request_scan() {
    request_.utime = now();
    ++request_.seq;
    if (!scanning_) {
      request_.windows = messages_of(pose_ ? planner_.around({*pose_}, 0.1, 1000)
                                           : std::vector{planner_.everything(6000)});
      request_.window_count = static_cast<std::int32_t>(request_.windows.size());
      request_.scan_id = ++state_.scan_id;
      scanning_ = true;
      beams_.clear();
    }
    bus().publish(channels::scan_request, request_);
  }

  void take(const ScanPacket& packet) {
    if (packet.session != session() || packet.scan_id != request_.scan_id || !scanning_) return;
    if (is_well_formed(packet)) append_beams(packet, beams_);
    if (packet.scan_status == ScanPacket::RUNNING) return;
    scanning_ = false;
    if (state_.mode == Mode::IDLE || packet.scan_status == ScanPacket::REFUSED) return;
    const PreprocessedScan scan = preprocess(beams_, gate_, lidar_.beam);
    const std::optional<ScanPose> found = estimate(scan, pose_);
    pose_ = found ? std::optional(found->pose) : std::nullopt;
    state_.mode = pose_ ? Mode::TRACKING : Mode::ACQUIRING;
    publish(found, scan.points.empty() ? now() : scan.utime_mean, packet.packet);
    request_scan();
    publish_state();
  }

  void publish(const std::optional<ScanPose>& found, Utime utime, std::int32_t last_packet) {
    pose_estimate_t message{};
    message.utime = utime;
    message.seq = ++estimate_seq_;
    message.session = session();
    message.command_seq = state_.command_seq;
    message.scan_id = request_.scan_id;
    message.last_packet = last_packet;  // the first is 0
    message.method = method();
    message.status = found ? pose_estimate_t::OK : pose_estimate_t::LOST;
    message.reason = found ? "" : "the target was not found in the scan";
    message.returns_used = found ? found->returns : 0;
    const Pose pose = found ? found->pose : Pose{};
    set_pose(pose, message);
    set_pose(pose, message.measured_position_m, message.measured_q_wxyz);
    if (found) set_covariance(found->covariance, message.covariance);
    bus().publish(channels::pose_estimate, message);
    report(found ? node_status_t::RUNNING : node_status_t::DEGRADED, message.reason);
  }

  void publish_state() {
    state_.utime = now();
    ++state_.seq;
    bus().publish(channels::estimator_state, state_);
  }

  const EstimatorOptions options_;
  const LidarProfile lidar_;
  const std::shared_ptr<const TargetModel> model_;
  const std::unique_ptr<Acquisition> acquisition_;
  const ScanPlanner planner_;
  RangeGate gate_ = options_.gate;
  std::optional<Pose> pose_;  // T_sensor_model, the last
  scan_request_t request_{};
  bool scanning_ = false;
  std::vector<RawBeam> beams_;  // of the scan under way
  estimator_state_t state_{};
  std::int64_t estimate_seq_ = 0;
  Loop::TimerId timer_ = 0;
};

/// As EstimatorPlugin::make. Method: derived from ScanEstimator, with its constructor.
template <class Method>
std::unique_ptr<Node> make_estimator(NodeSetup setup, const RunSetup& run, Bus& bus, Loop& loop) {
  return std::make_unique<Method>(std::move(setup), run, bus, loop);
}

}  // namespace berth::estimator
