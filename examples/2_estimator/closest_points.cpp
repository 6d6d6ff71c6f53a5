// SPDX-License-Identifier: BSD-3-Clause
// An estimator of one's own: all that it must receive and publish (docs/own_estimator.md).
//     berth run --twin --estimator build/release/examples/closest_points.so
//     procedures/track_static.yaml berth run --estimator build/release/examples/closest_points
//     procedures/track_static.yaml
#include "examples/2_estimator/closest_points.h"

#include "common/targets/target.h"
#include "estimator/node/estimator.h"
#include "estimator/node/estimator_plugin.h"
#include "estimator/node/messages.h"
#include "examples/2_estimator/point_to_plane.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/conversions.h"

using namespace berth;
using namespace berth::estimator;

namespace {

class ClosestPoints final : public Node {
 public:
  ClosestPoints(NodeSetup setup, const RunSetup& run, Bus& the_bus, Loop& the_loop)
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
  ~ClosestPoints() override { loop().cancel(timer_); }

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

  /// For a scan of everything, or of where the target was; again for the one that does not come.
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
    estimate(preprocess(beams_, gate_, lidar_.beam), packet.packet);
    request_scan();
    publish_state();
  }

  void estimate(const PreprocessedScan& scan, std::int32_t last_packet) {
    pose_estimate_t message{};
    if (!pose_) {
      const AcquisitionResult found = acquisition_->acquire(scan);
      if (found.status == AcquisitionResult::Status::found) pose_ = found.hypotheses.front().pose;
    }
    const auto fit = pose_ ? fit_to_mesh(scan.points, model_->grid, *pose_) : std::nullopt;
    pose_ = fit ? std::optional(fit->pose) : std::nullopt;
    if (fit) set_covariance(fit->covariance, message.covariance);
    message.returns_used = fit ? fit->used : 0;
    state_.mode = pose_ ? Mode::TRACKING : Mode::ACQUIRING;
    message.status = pose_ ? pose_estimate_t::OK : pose_estimate_t::LOST;
    message.reason = pose_ ? "" : "too few returns lie on the target";
    message.utime = scan.points.empty() ? now() : scan.utime_mean;
    message.seq = ++estimate_seq_;
    message.session = session();
    message.command_seq = state_.command_seq;
    message.scan_id = request_.scan_id;
    message.last_packet = last_packet;  // the first is 0
    message.method = "closest_points";
    const Pose pose = pose_.value_or(Pose{});
    set_pose(pose, message);
    set_pose(pose, message.measured_position_m, message.measured_q_wxyz);
    bus().publish(channels::pose_estimate, message);
    report(pose_ ? node_status_t::RUNNING : node_status_t::DEGRADED, message.reason);
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

}  // namespace

std::unique_ptr<Node> make_closest_points(NodeSetup setup, const RunSetup& run, Bus& bus,
                                          Loop& loop) {
  return std::make_unique<ClosestPoints>(std::move(setup), run, bus, loop);
}
BERTH_ESTIMATOR_PLUGIN(make_closest_points)
