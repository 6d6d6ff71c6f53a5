// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/arm/arm_node.h"

#include <algorithm>
#include <cmath>

#include "common/core/config.h"
#include "common/core/text.h"
#include "drivers/arm/snpx_adapter.h"
#include "lcmtypes/channels.h"

namespace berth {
namespace {

constexpr Utime offline_period = 100 * millisecond;
constexpr Utime start_time_limit = second;
constexpr Utime hold_repeat_period = 250 * millisecond;

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

ArmNode::ArmNode(NodeSetup node, Setup setup, std::unique_ptr<ArmAdapter> adapter, Bus& bus,
                 Loop& loop)
    : Node(std::move(node), bus, loop),
      arm_(std::move(setup)),
      adapter_(std::move(adapter)),
      name_(std::string(name_of(arm_.role)) + " arm"),
      state_channel_(arm_state_channel(arm_.role)),
      clock_(adapter_->capabilities().clock_resolution),
      following_error_(arm_.device.following_lag) {
  adapter_->start(
      {[this](ArmAdapter::Change change, const std::string& text) { on_change(change, text); },
       [this](const ArmReport& report) { on_report(report); },
       [this](const std::string& error, bool refused) { on_missed(error, refused); }});
  // FIFO: a HOLD must not be replaced by the set-point behind it. The newest set-point is kept
  // here.
  bus.subscribe<arm_command_t>(arm_command_channel(arm_.role), Queue::fifo(100),
                               [this](const arm_command_t& command) { on_command(command); });
  poll_timer_ = loop.every(arm_.device.status_period, [this] { poll(); });
  write_timer_ = loop.every(arm_.device.setpoint_period, [this] { write_setpoint(); });
  statistics_timer_ = loop.every(second, [this] { show_statistics(); });
  report(node_status_t::STARTING, "waiting for the controller at " + adapter_->name());
  if (const double lag = arm_.device.following_lag; lag > 0) {
    event(event_t::NOTICE, "positions-commanded",
          name_ + ": the controller reports commanded positions; the servos follow within " +
              fixed(1e3 * lag, 1) + " ms (1 sigma)");
  }
}

ArmNode::~ArmNode() {
  loop().cancel(poll_timer_);
  loop().cancel(write_timer_);
  loop().cancel(statistics_timer_);
}

// ---- connection ----

void ArmNode::on_change(ArmAdapter::Change change, const std::string& text) {
  using Change = ArmAdapter::Change;
  const std::string setpoints = name_ + ", connection for set-points";
  switch (change) {
    case Change::connected:
      return event(event_t::INFO, "arm-connected", name_ + " at " + adapter_->name());
    case Change::ready:
      wrong_setup_.clear();
      clock_.clear();
      following_error_.clear();
      have_report_ = false;
      unchanged_reads_ = 0;
      return report(node_status_t::READY);
    case Change::not_verified:
      return event(event_t::WARNING, "arm-map-not-verified", name_ + ": " + text);
    case Change::wrong:
      if (wrong_setup_ != text) event(event_t::ERROR, "arm-map-wrong", name_ + ": " + text);
      wrong_setup_ = text;
      report(node_status_t::FAULT, text);
      return publish_offline();
    case Change::lost:
      event(event_t::WARNING, "arm-disconnected", name_ + ": " + text);
      offline_reason_ = text;
      if (following_) hold();  // the arm's position is unknown
      report(node_status_t::DEGRADED, text);
      return publish_offline();
    case Change::setpoints_open:
      if (!setpoints_closed_.empty()) {
        event(event_t::INFO, "arm-connected", setpoints + " at " + adapter_->name());
      }
      return setpoints_closed_.clear();
    case Change::setpoints_closed:  // no heartbeat of the host comes to the controller either
      event(event_t::WARNING, "arm-disconnected", setpoints + ": " + text);
      if (following_) hold();
      setpoints_closed_ = text;
  }
}

void ArmNode::publish_offline() {
  const Utime t = now();
  last_published_ = t;
  arm_state_t state{};
  state.utime = t;
  state.utime_sent = state.utime_received = t;
  state.state = wrong_setup_.empty() ? arm_state_t::OFFLINE : arm_state_t::FAULT;
  state.reason = wrong_setup_.empty() ? offline_reason_ : wrong_setup_;
  publish(state);
}

// ---- status ----

void ArmNode::poll() {
  if (!adapter_->ready()) {
    if (now() - last_published_ >= offline_period) publish_offline();
    return;
  }
  if (read_under_way_) {
    ++reads_missed_;
    return;
  }
  read_under_way_ = true;
  adapter_->poll();
}

void ArmNode::on_missed(const std::string& error, bool refused) {
  read_under_way_ = false;
  ++reads_missed_;
  if (!refused) return;
  offline_reason_ = "status read " + error;
  if (now() - last_published_ >= offline_period) publish_offline();
}

void ArmNode::on_report(const ArmReport& report_now) {
  read_under_way_ = false;
  ++reads_;
  const double cycle = have_report_ ? seconds(report_now.received - report_.received) : 0;
  ++statistics_.reads;
  statistics_.interval_sum += cycle;
  statistics_.interval_square_sum += cycle * cycle;
  statistics_.max_round_trip =
      std::max(statistics_.max_round_trip, seconds(report_now.received - report_now.sent));

  const bool renewed = !have_report_ || report_now.controller_time != report_.controller_time;
  report_ = report_now;
  have_report_ = true;

  if (renewed) {
    if (!clock_.add(report_.sent, report_.controller_time, report_.received)) {
      event(event_t::WARNING, "arm-clock-set",
            name_ + ": its clock jumped; the controller may have been started anew");
    }
    unchanged_reads_ = 0;
    if (report_.valid) following_error_.add(report_.controller_time, report_.joints);
  } else if (++unchanged_reads_ < arm_.device.stale_polls) {
    return;  // the same sample once more
  }
  const bool stale = unchanged_reads_ >= arm_.device.stale_polls;

  arm_state_t state{};
  // The tick identifies the interpolation period the joints are of; the bracket only bounds it.
  state.utime = stale ? report_.sent + (report_.received - report_.sent) / 2
                      : clock_.line().to_host(report_.controller_time) - arm_.device.report_lag;
  // A stamp not after the last one (the clock was set, the clock map moved) would give a false
  // rate.
  if (!stale && state.utime <= state_.utime) {
    ++samples_not_placed_;
    return;
  }
  state.utime_sent = report_.sent;
  state.utime_received = report_.received;
  state.controller_time_us = report_.controller_time;
  state.clock_offset_s = seconds(clock_.line().offset);
  state.clock_offset_sigma_s = clock_.line().sigma_s;
  state.valid = report_.valid && !stale;
  for (std::size_t i = 0; i < 6; ++i) {
    state.reported_joint[i] = report_.joints[i];
    const bool linear = arm_.kinematics->is_linear(static_cast<int>(i));
    state.reported_joint_sigma[i] = std::hypot(
        linear ? arm_.device.linear_sigma : arm_.device.rotary_sigma, following_error_.joints()[i]);
  }
  state.state = stale ? arm_state_t::FAULT : published_state(report_.state);
  if (stale) {
    state.reason = "the controller's tick stands still";
  } else if (!report_.valid) {
    state.reason = "the controller marks its joints as not valid";
  } else if (report_.error != 0) {
    state.reason = "controller error " + std::to_string(report_.error) +
                   (report_.alarm.empty() ? "" : ": " + report_.alarm);
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
  if (hold_requested_ && running && now() - hold_repeated_ > hold_repeat_period) hold();
  const bool healthy = !stale && report_.valid && setpoints_closed_.empty();
  report(!healthy     ? node_status_t::DEGRADED
         : following_ ? node_status_t::RUNNING
                      : node_status_t::READY,
         state.reason.empty() ? setpoints_closed_ : state.reason);
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
  count("round_trip_max_ms", 1e3 * statistics_.max_round_trip);
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
  // Of the layout only the arm: rooms and targets are not a driver's business.
  Config layout = Config::load(run.layout_file());
  setup.kinematics = ArmKinematics::load(run.config / layout.section(name_of(role)).text("arm"));
  auto adapter = std::make_unique<SnpxAdapter>(
      setup.device,
      RegisterMap::load(run.config / "registers" / (setup.device.registers + ".yaml")),
      *setup.kinematics, loop);
  return std::make_unique<ArmNode>(std::move(node), std::move(setup), std::move(adapter), bus,
                                   loop);
}

}  // namespace berth
