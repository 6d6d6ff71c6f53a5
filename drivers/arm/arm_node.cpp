// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/arm/arm_node.h"

#include <algorithm>
#include <cmath>

#include "common/core/config.h"
#include "common/core/text.h"
#include "lcmtypes/channels.h"

namespace berth {
namespace {

constexpr Utime offline_period = 100 * millisecond;
constexpr Utime recheck_period = 5 * second;
constexpr Utime start_time_limit = second;
constexpr Utime hold_repeat_period = 250 * millisecond;

std::array<bool, 6> linear_axes(const ArmKinematics& kinematics) {
  std::array<bool, 6> linear{};
  for (std::size_t i = 0; i < 6; ++i) linear[i] = kinematics.is_linear(static_cast<int>(i));
  return linear;
}

RegisterLink::Options link_options(const ArmDevice& device, int unit) {
  RegisterLink::Options options;
  options.address = device.address;
  options.unit = unit;
  options.timeout = device.timeout;
  options.dial_timeout = device.dial_timeout;
  return options;
}

std::int8_t published_state(int controller_state) {
  switch (static_cast<ControllerState>(controller_state)) {
    case ControllerState::idle:
      return arm_state_t::IDLE;
    case ControllerState::running:
      return arm_state_t::RUNNING;
    case ControllerState::held:
      return arm_state_t::HELD;
    case ControllerState::emergency_stop:
      return arm_state_t::ESTOP;
    case ControllerState::fault:
      break;
  }
  return arm_state_t::FAULT;
}

}  // namespace

std::string arm_state_channel(ArmRole role) {
  return role == ArmRole::replica ? channels::arm_state_replica : channels::arm_state_sensor;
}

std::string arm_command_channel(ArmRole role) {
  return role == ArmRole::replica ? channels::arm_command_replica : channels::arm_command_sensor;
}

ArmNode::ArmNode(NodeSetup node, Setup setup, Bus& bus, Loop& loop)
    : Node(std::move(node), bus, loop),
      arm_(std::move(setup)),
      wire_(arm_.map, linear_axes(*arm_.kinematics)),
      name_(std::string(name_of(arm_.role)) + " arm"),
      state_channel_(arm_state_channel(arm_.role)),
      clock_(arm_.map.tick_period),
      reader_(make_register_link(
          loop, link_options(arm_.device, arm_.map.unit),
          [this](bool up, const std::string& reason) { on_connection(up, reason); })),
      writer_(make_register_link(
          loop, link_options(arm_.device, arm_.map.unit),
          [this](bool up, const std::string& reason) { on_writer_connection(up, reason); })) {
  // FIFO: a HOLD must not be replaced by the set-point behind it. The newest set-point is kept
  // here.
  bus.subscribe<arm_command_t>(arm_command_channel(arm_.role), Queue::fifo(100),
                               [this](const arm_command_t& command) { on_command(command); });
  poll_timer_ = loop.every(arm_.device.status_period, [this] { poll(); });
  write_timer_ = loop.every(arm_.device.setpoint_period, [this] { write_setpoint(); });
  statistics_timer_ = loop.every(second, [this] { show_statistics(); });
  report(node_status_t::STARTING, "waiting for the controller at " + arm_.device.address);
}

ArmNode::~ArmNode() {
  loop().cancel(poll_timer_);
  loop().cancel(write_timer_);
  loop().cancel(statistics_timer_);
  loop().cancel(recheck_timer_);
  for (const auto& [coil, timer] : pulse_timers_) loop().cancel(timer);
}

// ---- connection ----

void ArmNode::on_connection(bool connected, const std::string& reason) {
  if (connected) {
    event(event_t::INFO, "arm-connected", name_ + " at " + arm_.device.address);
    check_assignments();
    return;
  }
  event(event_t::WARNING, "arm-disconnected", name_ + ": " + reason);
  ready_ = false;
  check_.reset();
  offline_reason_ = reason;
  if (following_) hold();  // nobody sees where the arm goes
  report(node_status_t::DEGRADED, reason);
  publish_offline();
}

/// Without it no set-point and no heartbeat of the host comes to the controller.
void ArmNode::on_writer_connection(bool connected, const std::string& reason) {
  const std::string text = name_ + ", connection for set-points";
  if (!connected) {
    event(event_t::WARNING, "arm-disconnected", text + ": " + reason);
    if (following_) hold();
  } else if (!writer_reason_.empty()) {
    event(event_t::INFO, "arm-connected", text + " at " + arm_.device.address);
  }
  writer_reason_ = reason;
}

void ArmNode::check_assignments() {
  recheck_timer_ = 0;
  check_ = std::make_shared<AssignmentCheck>(
      *reader_, wire_.map(), [this](AssignmentCheck::Result result, const std::string& text) {
        on_checked(result, text);
      });
  check_->start();
}

void ArmNode::on_checked(AssignmentCheck::Result result, const std::string& text) {
  using Result = AssignmentCheck::Result;
  if (result == Result::failed) return;  // the lost connection is reported by itself
  if (result == Result::differs) {
    if (wrong_map_ != text) {
      event(event_t::ERROR, "arm-map-wrong", name_ + ": " + text);
    }
    wrong_map_ = text;
    report(node_status_t::FAULT, "register map: " + text);
    publish_offline();
    recheck_timer_ = loop().after(recheck_period, [this] { check_assignments(); });
    return;
  }
  wrong_map_.clear();
  if (result == Result::not_offered) {
    event(event_t::WARNING, "arm-map-not-verified", name_ + ": " + text);
  }
  // A pulse that a lost connection cut short would be one still.
  for (const int coil : {arm_.map.start_coil, arm_.map.hold_coil, arm_.map.reset_coil}) {
    if (pulse_timers_.count(coil) == 0) {
      reader_->write_coil(coil, false, [](const RegisterAnswer&) {});
    }
  }
  clock_.clear();
  have_report_ = false;
  unchanged_reads_ = 0;
  ready_ = true;
  report(node_status_t::READY);
}

void ArmNode::publish_offline() {
  const Utime t = now();
  last_published_ = t;
  arm_state_t state{};
  state.utime = t;
  state.utime_sent = state.utime_received = t;
  state.state = wrong_map_.empty() ? arm_state_t::OFFLINE : arm_state_t::FAULT;
  state.reason = wrong_map_.empty() ? offline_reason_ : "register map: " + wrong_map_;
  publish(state);
}

// ---- status ----

void ArmNode::poll() {
  if (!ready_) {
    if (now() - last_published_ >= offline_period) publish_offline();
    return;
  }
  if (read_under_way_) {
    ++reads_missed_;
    return;
  }
  read_under_way_ = true;
  reader_->read_registers(wire_.map().status.first, wire_.map().status.count,
                          [this](const RegisterAnswer& answer) { on_status(answer); });
}

void ArmNode::on_status(const RegisterAnswer& answer) {
  read_under_way_ = false;
  if (!answer.ok()) {
    ++reads_missed_;
    if (answer.exception != 0) {
      offline_reason_ = "status read " + answer.error;
      if (now() - last_published_ >= offline_period) publish_offline();
    }
    return;
  }
  ++reads_;
  on_report(wire_.decode(answer.words), answer);
}

/// What the controller's tick counts, us, beyond its wraps.
Utime ArmNode::controller_time(int tick_ms) const {
  if (!have_report_) return tick_ms * millisecond;
  const int wrap = arm_.map.counter_wrap;
  const int step = ((tick_ms - last_tick_ms_) % wrap + wrap) % wrap;
  return controller_time_ + step * millisecond;
}

void ArmNode::on_report(const ArmReport& report_now, const RegisterAnswer& answer) {
  const double cycle = have_report_ ? seconds(answer.received - last_received_) : 0;
  ++statistics_.reads;
  statistics_.interval_sum += cycle;
  statistics_.interval_square_sum += cycle * cycle;
  statistics_.longest_round_trip =
      std::max(statistics_.longest_round_trip, seconds(answer.received - answer.sent));

  const bool renewed = !have_report_ || report_now.tick_ms != last_tick_ms_;
  controller_time_ = controller_time(report_now.tick_ms);
  report_ = report_now;
  last_received_ = answer.received;
  have_report_ = true;
  last_tick_ms_ = report_.tick_ms;

  if (renewed) {
    if (!clock_.add(answer.sent, controller_time_, answer.received)) {
      event(event_t::WARNING, "arm-clock-set",
            name_ + ": its clock jumped; the controller may have been started anew");
    }
    unchanged_reads_ = 0;
  } else if (++unchanged_reads_ < arm_.device.stale_polls) {
    return;  // the same sample once more
  }
  const bool stale = unchanged_reads_ >= arm_.device.stale_polls;

  arm_state_t state{};
  // The tick says which interpolation period the joints are of; the bracket only bounds it.
  state.utime = stale ? answer.sent + (answer.received - answer.sent) / 2
                      : clock_.line().to_host(controller_time_) - arm_.device.report_lag;
  // A stamp that the last one has passed (the clock was set, the line moved) would make a rate of
  // its own.
  if (!stale && state.utime <= state_.utime) {
    ++samples_not_placed_;
    return;
  }
  state.utime_sent = answer.sent;
  state.utime_received = answer.received;
  state.controller_time_us = controller_time_;
  state.clock_offset_s = seconds(clock_.line().offset);
  state.clock_offset_sigma_s = clock_.line().sigma_s;
  state.valid = report_.valid && !stale;
  for (std::size_t i = 0; i < 6; ++i) {
    state.reported_joint[i] = report_.joints[i];
    state.reported_joint_sigma[i] = arm_.kinematics->is_linear(static_cast<int>(i))
                                        ? arm_.device.linear_sigma
                                        : arm_.device.rotary_sigma;
  }
  state.state = stale ? arm_state_t::FAULT : published_state(report_.state);
  if (stale) {
    state.reason = "the controller's tick stands still";
  } else if (!report_.valid) {
    state.reason = "the controller marks its joints as not valid";
  } else if (report_.error != 0) {
    state.reason = "controller error " + std::to_string(report_.error);
  } else if (held_by_session_) {
    state.reason = "a command of session " + std::to_string(*held_by_session_) + " holds it";
  }
  state.cycle_s = cycle;
  publish(state);

  const bool running = state.state == arm_state_t::RUNNING;
  if (start_pending_ && running) start_pending_ = false;
  if (start_pending_ && now() - started_ > start_time_limit) {
    hold_by_itself("start-failed", "the controller did not start: " + state.reason);
  }
  if (following_ && !start_pending_ && !running) {
    event(event_t::WARNING, "arm-stopped",
          name_ + " stopped by itself" + (state.reason.empty() ? "" : ": " + state.reason));
    stop_following();
  }
  if (hold_wanted_ && running && now() - hold_repeated_ > hold_repeat_period) hold();
  const bool healthy = !stale && report_.valid && writer_reason_.empty();
  report(!healthy     ? node_status_t::DEGRADED
         : following_ ? node_status_t::RUNNING
                      : node_status_t::READY,
         state.reason.empty() ? writer_reason_ : state.reason);
}

void ArmNode::publish(arm_state_t& state) {
  state.seq = state_.seq + 1;
  state.session = session();
  for (std::size_t i = 0; i < 6; ++i) state.commanded_joint[i] = order_.joints[i];
  state.setpoint_seq = order_.sequence;
  state.setpoint_seq_echoed = report_.setpoint_taken;
  state.controller_heartbeat = report_.heartbeat;
  state.error_code = report_.error;
  state.program_state = static_cast<std::int16_t>(report_.program_state);
  state.speed_override = report_.speed_override;
  state.tcp_speed_m_s = report_.tcp_speed;
  state.reads = reads_;
  state.reads_missed = reads_missed_;
  state_ = state;
  last_published_ = now();
  bus().publish(state_channel_, state);
}

void ArmNode::show_statistics() {
  const int n = statistics_.reads;
  const double mean = n > 0 ? statistics_.interval_sum / n : 0;
  const double variance = n > 0 ? statistics_.interval_square_sum / n - mean * mean : 0;
  count("reads_per_s", n);
  count("read_jitter_ms", 1e3 * std::sqrt(std::max(0.0, variance)));
  count("reads_missed", static_cast<double>(reads_missed_));
  count("round_trip_max_ms", 1e3 * statistics_.longest_round_trip);
  count("writes_per_s", statistics_.writes);
  count("writes_missed", static_cast<double>(writes_missed_));
  count("samples_not_placed", static_cast<double>(samples_not_placed_));
  if (clock_.valid()) {
    count("clock_offset_s", seconds(clock_.line().offset));
    count("clock_offset_sigma_ms", 1e3 * clock_.line().sigma_s);
    count("clock_drift_ppm", 1e6 * clock_.line().drift);
  }
  statistics_ = {};
}

std::unique_ptr<Node> make_arm_node(NodeSetup node, const RunSetup& run, ArmRole role, Bus& bus,
                                    Loop& loop) {
  ArmNode::Setup setup;
  setup.role = role;
  setup.device = load_devices(run.config).arm(role);
  setup.map = RegisterMap::load(run.config / "registers" / (setup.device.registers + ".yaml"));
  // Of the layout only the arm: rooms and targets are not a driver's business.
  Config layout = Config::load(run.layout_file());
  setup.kinematics = ArmKinematics::load(run.config / layout.section(name_of(role)).text("arm"));
  return std::make_unique<ArmNode>(std::move(node), std::move(setup), bus, loop);
}

}  // namespace berth
