// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/simulated_controller.h"

#include <cmath>

#include "common/core/spherical_wrist.h"
#include "drivers/arm/register_map.h"

namespace berth {
namespace {

constexpr int register_count = 16384;
constexpr int coil_count = 512;
/// R[n] of the variables that the robot's program and background logic keep.
enum Number { tick = 1, heartbeat, setpoint_taken, state, override, tcp_speed, error };
enum HostNumber { sequence = 31, command, host_heartbeat, speed_limit, setpoint_time, mode };
constexpr std::size_t setpoint_register = 1;  // PR[1]

}  // namespace

SimulatedController::SimulatedController(const std::string& address, const RegisterMap& map,
                                         const PlacedArm& arm, const ArmErrors& errors,
                                         Options options, Loop& loop)
    : map_(map),
      arm_(arm),
      errors_(errors),
      options_(options),
      loop_(loop),
      started_(loop.now()),
      robot_(arm.kinematics, options.robot, arm.home, loop.now()),
      memory_(map.assignments),
      image_(register_count, coil_count, coil_count),
      boot_ms_(static_cast<int>(errors.clock / millisecond)),
      server_(serve_registers(
          loop, {address, map.unit, options.connections, options.idle_timeout}, image_,
          [this](RegisterTable table, int first, int count) { before_read(table, first, count); },
          [this](RegisterTable table, int first, int count) {
            after_write(table, first, count);
          })) {}

void SimulatedController::advance() { robot_.advance(loop_.now()); }

Joints SimulatedController::true_joints(Utime t) {
  advance();
  Joints joints = robot_.joints_at(t);
  for (std::size_t i = 0; i < 6; ++i) joints[i] -= errors_.zero[i];
  return joints;
}

ControllerState SimulatedController::state() {
  advance();
  return robot_.state();
}

int SimulatedController::error() {
  advance();
  return robot_.error();
}

int SimulatedController::tick_ms() const {
  const double elapsed = static_cast<double>(robot_.tick() - started_) * (1 + errors_.drift);
  const auto ms = static_cast<std::int64_t>(std::floor(elapsed * 1e-3)) + boot_ms_;
  const std::int64_t wrapped = ms % map_.counter_wrap;
  return static_cast<int>(wrapped < 0 ? wrapped + map_.counter_wrap : wrapped);
}

Joints SimulatedController::reported(const Joints& encoders) const {
  Joints joints = encoders;
  const double drifting = seconds(loop_.now() - drift_since_);
  for (std::size_t i = 0; i < 6; ++i) {
    joints[i] += offset_[i] + drift_[i] + drift_rate_[i] * drifting;
    const double quantum = arm_.kinematics->is_linear(static_cast<int>(i))
                               ? options_.linear_quantum
                               : options_.rotary_quantum;
    if (quantum > 0) joints[i] = quantum * std::round(joints[i] / quantum);
  }
  return joints;
}

/// Registers change on the grid of the interpolation period.
void SimulatedController::renew_variables() {
  memory_.position.joints_valid = !joints_invalid_;
  memory_.numbers[Number::state] = static_cast<double>(robot_.state());
  memory_.numbers[Number::error] = robot_.error();
  memory_.numbers[Number::setpoint_taken] = robot_.setpoint_taken();
  memory_.program_state = robot_.program_state();
  memory_.alarm_number = robot_.error();
  memory_.alarm_text = robot_error::text(robot_.error());
  if (robot_.tick() == renewed_tick_ || frozen_) return;

  const Joints joints =
      reported(robot_.joints_at(robot_.tick() - options_.report_lag - errors_.report_lag));
  const double since = seconds(robot_.tick() - renewed_tick_);
  const bool first = renewed_tick_ < 0;
  renewed_tick_ = robot_.tick();
  const bool at_rest = !first && joints == renewed_joints_;
  const double way = at_rest ? 0 : renew_position(joints);
  renewed_joints_ = joints;
  memory_.numbers[Number::tick] = tick_ms();
  memory_.numbers[Number::heartbeat] = static_cast<double>(robot_.ticks() % map_.counter_wrap);
  memory_.numbers[Number::override] = 100 * robot_.speed_override();
  memory_.numbers[Number::tcp_speed] = first ? 0 : way / since;
}

double SimulatedController::renew_position(const Joints& joints) {
  const Xyzwpr xyzwpr = xyzwpr_from_pose(arm_.kinematics->forward(joints));
  double way = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    way += std::pow(xyzwpr[i] - memory_.position.cartesian[i], 2);
  }
  memory_.position.cartesian = xyzwpr;
  memory_.position.cartesian_valid = true;
  if (const auto* arm = dynamic_cast<const SphericalWristArm*>(arm_.kinematics.get())) {
    memory_.position.configuration = arm->configuration(joints);
  }
  for (std::size_t i = 0; i < 6; ++i) {
    memory_.position.joints[i] =
        pendant_from_si(joints[i], arm_.kinematics->is_linear(static_cast<int>(i)));
  }
  return std::sqrt(way);
}

void SimulatedController::before_read(RegisterTable table, int first, int count) {
  if (table != RegisterTable::registers) return;
  advance();
  renew_variables();
  memory_.read(first, image_.holding(first, count));
}

void SimulatedController::after_write(RegisterTable table, int first, int count) {
  advance();
  if (table == RegisterTable::coils) return after_coil_write();
  memory_.write(first, image_.holding(first, count));
  after_register_write();
}

void SimulatedController::after_register_write() {
  const Utime now = loop_.now();
  const auto number = [&](int n) {
    return static_cast<int>(std::lround(memory_.numbers[static_cast<std::size_t>(n)]));
  };
  if (number(HostNumber::host_heartbeat) != last_heartbeat_) {
    last_heartbeat_ = number(HostNumber::host_heartbeat);
    robot_.take_heartbeat(now);
  }
  robot_.set_speed_limit(memory_.numbers[HostNumber::speed_limit] / 100);
  robot_.set_follow(number(HostNumber::command) == 1 && number(HostNumber::mode) == 1);
  if (number(HostNumber::sequence) == last_sequence_) return;
  const SnpxPosition& setpoint = memory_.position_registers[setpoint_register];
  if (!setpoint.joints_valid) return;
  last_sequence_ = number(HostNumber::sequence);
  Joints joints{};
  for (std::size_t i = 0; i < 6; ++i) {
    joints[i] =
        si_from_pendant(setpoint.joints[i], arm_.kinematics->is_linear(static_cast<int>(i)));
  }
  robot_.take_setpoint(joints, last_sequence_, number(HostNumber::setpoint_time), now);
}

/// UI signals act on their rising edge; while HOLD is on nothing starts.
void SimulatedController::after_coil_write() {
  const bool coils[3] = {image_.coil(map_.start_coil), image_.coil(map_.hold_coil),
                         image_.coil(map_.reset_coil)};
  const auto rises = [&](int i) { return coils[i] && !coil_was_[i]; };
  if (coils[1]) robot_.hold();
  if (rises(2)) robot_.reset();
  if (rises(0) && !coils[1] && !frozen_) robot_.start(loop_.now());
  std::copy(std::begin(coils), std::end(coils), std::begin(coil_was_));
}

void SimulatedController::set_safety(bool estop_closed, bool fence_closed) {
  advance();
  estop_closed_ = estop_closed;
  fence_closed_ = fence_closed;
  robot_.set_safety(estop_closed, fence_closed);
}

void SimulatedController::freeze(bool frozen) {
  advance();
  frozen_ = frozen;
  robot_.freeze(frozen);
}

void SimulatedController::drift(const Joints& rate) {
  const double drifted = seconds(loop_.now() - drift_since_);
  for (std::size_t i = 0; i < 6; ++i) drift_[i] += drift_rate_[i] * drifted;
  drift_rate_ = rate;
  drift_since_ = loop_.now();
}

void SimulatedController::creep(const Joints& rate) {
  advance();
  robot_.creep(rate);
}

void SimulatedController::set_override(double fraction) {
  advance();
  robot_.set_override(fraction);
}

void SimulatedController::run_away(const Joints& rate) {
  advance();
  robot_.run_away(rate);
}

void SimulatedController::reboot() {
  advance();
  const Joints where = robot_.joints_at(loop_.now());
  const double override = robot_.speed_override();
  robot_ = SimulatedRobot(arm_.kinematics, options_.robot, where, loop_.now());
  robot_.set_safety(estop_closed_, fence_closed_);
  robot_.set_override(override);
  started_ = loop_.now();
  boot_ms_ = 0;
  renewed_tick_ = -1;
  memory_.numbers.fill(0);
  memory_.position_registers.fill({});
  last_sequence_ = last_heartbeat_ = 0;
  server_->drop_connections();
}

}  // namespace berth
