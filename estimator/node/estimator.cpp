// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/node/estimator.h"

#include <algorithm>
#include <berth/event_t.hpp>
#include <cmath>

#include "estimator/node/messages.h"
#include "lcmtypes/conversions.h"

namespace berth::estimator {

namespace {

using Command = estimator_command_t;

// Accuracy of an initial pose in a command.
constexpr double given_pose_sigma_m = 0.05;
constexpr double given_pose_sigma_rad = radians(3);

}  // namespace

Estimator::Estimator(EstimatorSetup setup, EstimatorOutput& output)
    : setup_(std::move(setup)),
      output_(output),
      noise_(setup_.lidar.beam, setup_.options.noise),
      tracker_(make_tracker(setup_.options)) {
  now_.session = setup_.session;
  now_.gate = setup_.options.gate;
  now_.strategy = setup_.options.strategy;
  now_.returns_per_scan = default_returns();
  use_model(setup_.find_model(setup_.target));
  mode_reason_ = "waiting for a command";
}

void Estimator::use_model(std::shared_ptr<const TargetModel> model) {
  model_ = std::move(model);
  const EstimatorOptions& o = setup_.options;
  acquisition_ = make_acquisition(o, *model_, noise_.beam());
  tracking_ = make_tracking(o, *model_, noise_.beam());
  planner_ = std::make_unique<ScanPlanner>(*model_, field_of_view(), o.planner);
  ranges_ = std::make_unique<RangeSwitch>(*model_, setup_.lidar, o.ranges);
  long_range_ = std::make_unique<LongRange>(*model_, noise_.beam(), o.ranges.axis_returns);
  forget_target();
}

// ------------------------------------------------------------------------------------------
// commands

std::string Estimator::refusal_of(const Command& command,
                                  std::shared_ptr<const TargetModel>& model) const {
  if (command.command < Command::STOP || command.command > Command::SCAN) {
    return "command " + std::to_string(command.command) + " is unknown";
  }
  if (scan_ && command.first_scan_id <= last_id_) {
    return "late: scan " + std::to_string(last_id_) + " is already requested, the command is for " +
           std::to_string(command.first_scan_id);
  }
  const std::string malformed = why_malformed(command);
  if (!malformed.empty()) return malformed;

  // As things will be when the commands before this one are obeyed.
  std::shared_ptr<const TargetModel> coming = model_;
  bool pose = tracker_->started() || now_.mode == Mode::ACQUIRING;
  for (const PendingCommand& p : pending_) {
    if (p.command.command == Command::CHOOSE_MODEL) {
      coming = p.model;
      pose = false;
    }
    if (p.command.command == Command::ACQUIRE || p.command.has_initial_pose) pose = true;
  }
  if (command.command == Command::CHOOSE_MODEL) {
    try {
      model = setup_.find_model(command.target);
    } catch (const InputError& error) {
      return error.what();
    }
  }
  if (command.command == Command::ACQUIRE) {
    return make_acquisition(setup_.options, *coming, setup_.lidar.beam)->refusal();
  }
  if (command.command == Command::TRACK && !command.has_initial_pose && !pose) {
    return "no pose to track from: acquire first, or give one";
  }
  return "";
}

void Estimator::receive(const Command& command) {
  std::int64_t& last_seq = last_seqs_[{command.session, command.commander}];
  if (command.seq <= last_seq) {
    // Repeated: the answer may have been lost, and so may the request that followed.
    publish_state();
    if (scan_ && !scan_->held_back) publish_request();
    return;
  }
  last_seq = command.seq;
  last_input_utime_ = command.utime;
  std::shared_ptr<const TargetModel> model;
  const std::string refusal = refusal_of(command, model);
  if (!refusal.empty()) {
    state_.refused_seq = command.seq;
    state_.reason = refusal;
    publish_state();
    return;
  }
  state_.command_seq = command.seq;
  pending_.push_back({command, std::move(model)});
  if (!scan_) start_next_scan(false);
  state_.reason = mode_reason_;
  publish_changed_state();
}

/// Returns of a tracking scan without a number in the command.
int Estimator::default_returns() const {
  const EstimatorOptions& o = setup_.options;
  return std::min(o.returns_per_scan, static_cast<int>(o.max_scan_time_s * setup_.lidar.rate_hz));
}

void Estimator::execute(const PendingCommand& pending) {
  const Command& command = pending.command;
  now_.session = command.session;
  now_.command_seq = command.seq;
  if (command.command == Command::ACQUIRE || command.command == Command::TRACK) {
    const bool own_gate = command.gate_near_m == 0 && command.gate_far_m == 0;
    now_.gate = own_gate ? setup_.options.gate : RangeGate{command.gate_near_m, command.gate_far_m};
    now_.returns_per_scan =
        command.returns_per_scan > 0 ? command.returns_per_scan : default_returns();
    now_.acquire_returns = command.command == Command::ACQUIRE ? command.returns_per_scan : 0;
    now_.strategy = setup_.options.strategy;
    if (!command.strategy.empty()) parse_scan_strategy(command.strategy, now_.strategy);
    failures_ = 0;
  }
  switch (command.command) {
    case Command::STOP:
      change_mode(Mode::IDLE, "stopped");
      break;
    case Command::ACQUIRE:
      forget_target();
      change_mode(Mode::ACQUIRING, "acquiring");
      break;
    case Command::TRACK:
      if (command.has_initial_pose) {
        start_from(pose_of(command.initial_position_m, command.initial_q_wxyz),
                   diagonal_covariance(given_pose_sigma_m, given_pose_sigma_rad), command.utime);
      } else if (now_.mode != Mode::TRACKING && tracker_->started()) {
        // The target may have moved during a pause.
        start_from(tracker_->pose(), resumed_covariance(), command.utime);
      }
      if (tracker_->started()) {
        change_mode(Mode::TRACKING, "tracking");
      } else {
        change_mode(Mode::ACQUIRING, "acquiring before tracking");
      }
      break;
    case Command::CHOOSE_MODEL:
      forget_target();
      use_model(pending.model);
      change_mode(Mode::IDLE, "model chosen");
      break;
    case Command::SCAN:
      own_scans_.push_back(command.windows);
      break;
    default:
      break;
  }
}

void Estimator::execute_commands_up_to(std::int64_t scan_id) {
  for (auto it = pending_.begin(); it != pending_.end();) {
    if (it->command.first_scan_id > scan_id) {
      ++it;
      continue;
    }
    const PendingCommand pending = *it;
    it = pending_.erase(it);
    execute(pending);
  }
}

// ---------------------------------------------------------------------------------------------
// scans

void Estimator::start_next_scan(bool hold_back) {
  std::int64_t next = last_id_ + 1;
  execute_commands_up_to(next);
  const auto scanning = [&] {
    return !own_scans_.empty() || now_.mode == Mode::ACQUIRING || now_.mode == Mode::TRACKING;
  };
  // Idle: no scan will come before the one a command waits for.
  while (!scanning() && !pending_.empty()) {
    next = std::max(next, pending_.front().command.first_scan_id);
    for (const PendingCommand& p : pending_)
      next = std::min(next, std::max(last_id_ + 1, p.command.first_scan_id));
    execute_commands_up_to(next);
  }
  if (!scanning()) {
    publish_changed_state();
    return;
  }
  last_id_ = next - 1;
  if (!own_scans_.empty()) {
    std::vector<scan_window_t> windows = std::move(own_scans_.front());
    own_scans_.pop_front();
    request_scan(std::move(windows), "procedure", true, hold_back);
    return;
  }
  std::vector<Window> windows = plan_windows();
  while (windows.empty() && now_.mode == Mode::TRACKING) {
    count_failure("the target is out of the field of view");
    windows = plan_windows();
  }
  if (windows.empty()) {
    publish_changed_state();
    return;
  }
  request_scan(messages_of(windows), now_.mode == Mode::ACQUIRING ? "acquire" : "track", false,
               hold_back);
}

void Estimator::request_scan(std::vector<scan_window_t> windows, const std::string& purpose,
                             bool own_windows, bool hold_back) {
  Scan scan;
  scan.id = ++last_id_;
  scan.own_windows = own_windows;
  scan.held_back = hold_back;
  scan.request.utime = last_input_utime_;
  scan.request.session = now_.session;
  scan.request.scan_id = scan.id;
  scan.request.action = scan_request_t::SCAN;
  scan.request.purpose = purpose;
  scan.request.window_count = static_cast<std::int32_t>(windows.size());
  scan.request.windows = std::move(windows);
  scan_ = std::move(scan);
  if (!hold_back) publish_request();
  publish_changed_state();
}

void Estimator::publish_request() {
  scan_->held_back = false;
  scan_->request.seq = ++request_seq_;
  output_.request(scan_->request);
}

void Estimator::receive(const ScanPacket& packet) {
  if (!is_well_formed(packet)) {
    output_.note(event_t::WARNING, "bad-packet", "an inconsistent scan packet is ignored");
    return;
  }
  const bool ends_scan = packet.scan_status != ScanPacket::RUNNING;
  if (packet.scan_id <= finished_id_) {
    // An idle LIDAR repeats the end of its last scan: it has not received the request.
    if (ends_scan && scan_) publish_request();
    return;
  }
  if (scan_ && packet.scan_id > scan_->id) {
    // A later scan: this one gets no more packets.
    if (!scan_->packets.empty()) finish_scan();
    if (scan_ && packet.scan_id > scan_->id) {
      // Not the scan requested, yet a usable one.
      output_.note(event_t::NOTICE, "scan-skipped",
                   "scan " + std::to_string(packet.scan_id) + " arrived while scan " +
                       std::to_string(scan_->id) + " was expected");
      execute_commands_up_to(packet.scan_id);
      scan_->id = packet.scan_id;
      scan_->held_back = false;
      last_id_ = packet.scan_id;
      finished_id_ = packet.scan_id - 1;
    }
  }
  if (!scan_) {
    // A scan without a request: only its number matters, the next request continues from it.
    last_id_ = std::max(last_id_, packet.scan_id);
    finished_id_ = std::max(finished_id_, ends_scan ? packet.scan_id : packet.scan_id - 1);
    publish_changed_state();
    return;
  }
  if (packet.scan_id < scan_->id) return;
  if (!scan_->packets.emplace(packet.packet, packet).second) return;
  const std::int64_t until = utime_of_end(packet);
  last_input_utime_ = std::max(last_input_utime_, until);
  if (ends_scan) {
    finish_scan();
  } else {
    stream();
  }
}

void Estimator::receive(const inertial_motion_t& motion) {
  if (!setup_.options.inertial_motion) return;
  if (is_well_formed(motion)) {
    sensor_motions_.add(sensor_motion_of(motion));
  } else {
    output_.note(event_t::WARNING, "bad-inertial-motion",
                 "an inconsistent inertial motion is ignored");
  }
}

Estimator::FinishedScan Estimator::finished_scan(const Scan& scan) const {
  FinishedScan b;
  b.id = scan.id;
  b.own_windows = scan.own_windows;
  b.status = ScanPacket::ABORTED;
  b.reason = "its end did not arrive";
  b.first_packet = scan.packets.begin()->first;
  b.last_packet = scan.packets.rbegin()->first;
  b.packets_missing = b.last_packet + 1 - static_cast<std::int32_t>(scan.packets.size());
  for (const auto& [index, packet] : scan.packets) {
    append_beams(packet, b.beams);
    b.utime = std::max(b.utime, utime_of_end(packet));
    if (packet.scan_status != ScanPacket::RUNNING) {
      b.status = packet.scan_status;
      b.reason = packet.reason;
    }
  }
  return b;
}

void Estimator::finish_scan() {
  const FinishedScan b = finished_scan(*scan_);
  finished_id_ = scan_->id;
  scan_.reset();
  stream_.reset();
  process(b);
  // A scan that failed at once is not requested again at once: the request waits for the LIDAR's
  // next status, which comes once a second.
  const bool failed = b.status == ScanPacket::REFUSED || b.status == ScanPacket::ABORTED;
  start_next_scan(failed && b.beams.empty());
}

// ---------------------------------------------------------------------------------------------
// state

void Estimator::change_mode(std::int8_t mode, const std::string& reason) {
  now_.mode = mode;
  mode_reason_ = reason;
  state_.reason = reason;
}

void Estimator::publish_changed_state() {
  const bool changed = state_.command_seq != published_.command_seq ||
                       state_.refused_seq != published_.refused_seq ||
                       state_.reason != published_.reason || now_.mode != published_.mode ||
                       last_id_ != published_.scan_id || now_.session != published_.session ||
                       model_->target.name != published_.target;
  if (changed) publish_state();
}

void Estimator::publish_state() {
  state_.utime = last_input_utime_;
  ++state_.seq;
  state_.session = now_.session;
  state_.mode = now_.mode;
  state_.scan_id = last_id_;
  state_.target = model_->target.name;
  published_ = state_;
  output_.state(published_);
}

}  // namespace berth::estimator
