// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/simulated_robot.h"

#include <algorithm>
#include <cmath>

namespace berth {
namespace {

/// Relaxation of the smallest delay found, us per set-point: covers the drift of two clocks.
constexpr Utime offset_relaxation = 20;
/// A set-point after a pause is reached from the last one in this time.
constexpr Utime resumption = 16 * millisecond;

/// The greatest speed that can be braked within `way` at the deceleration a, in periods of dt.
double brakable_speed(double way, double a, double dt) {
  const double step = a * dt * dt;
  const double periods = std::max(1.0, std::ceil(0.5 * (std::sqrt(1 + 8 * way / step) - 1)));
  return way / (periods * dt) + 0.5 * a * dt * (periods - 1);
}

}  // namespace

const char* robot_error::text(int error) {
  switch (error) {
    case none:
      return "";
    case host_heartbeat:
      return "HOST-101 Host heartbeat lost";
    case joint_limit:
      return "MOTN-017 Limit error";
    case emergency_stop:
      return "SRVO-001 Emergency stop";
    case fence:
      return "SRVO-004 Fence open";
    default:
      return "unknown";
  }
}

SimulatedRobot::SimulatedRobot(std::shared_ptr<const ArmKinematics> kinematics, Options options,
                               const Joints& start, Utime now)
    : kinematics_(std::move(kinematics)),
      options_(options),
      last_heartbeat_(now),
      loop_(options.cnt),
      tick_(now) {
  // Motor coordinates are linear in the joints (J2/J3 coupling): find the matrix.
  const Joints none = kinematics_->motor_joints(Joints{});
  for (std::size_t j = 0; j < 6; ++j) {
    Joints unit{};
    unit[j] = 1;
    const Joints motors = kinematics_->motor_joints(unit);
    for (std::size_t i = 0; i < 6; ++i) {
      motors_of_joints_(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          motors[i] - none[i];
    }
  }
  joints_of_motors_ = motors_of_joints_.inverse();
  for (std::size_t i = 0; i < 6; ++i) {
    speed_[static_cast<Eigen::Index>(i)] = kinematics_->limits()[i].speed;
    acceleration_[static_cast<Eigen::Index>(i)] = kinematics_->limits()[i].acceleration;
  }
  history_.fill(to_motors(start));
}

SimulatedRobot::Motors SimulatedRobot::to_motors(const Joints& joints) const {
  return motors_of_joints_ * Eigen::Map<const Motors>(joints.data());
}

Joints SimulatedRobot::to_joints(const Motors& motors) const {
  Joints joints{};
  Eigen::Map<Motors>(joints.data()) = joints_of_motors_ * motors;
  return joints;
}

void SimulatedRobot::advance(Utime now) {
  while (tick_ + options_.interpolation_period <= now) {
    tick_ += options_.interpolation_period;
    ++ticks_;
    step();
  }
}

void SimulatedRobot::step() {
  if (state_ == ControllerState::running) {
    if (tick_ - last_heartbeat_ > options_.watchdog) {
      hold(robot_error::host_heartbeat);
    } else if (!follow_) {
      hold();
    }
  }
  setpoint_taken_ = setpoint_pending_;
  const Utime next = tick_ + options_.interpolation_period;
  const Motors& here = at_tick(ticks_);
  if (state_ == ControllerState::running && !frozen_) {
    velocity_ = run_program(next);
  } else {
    velocity_ = braked(state_ == ControllerState::emergency_stop ? options_.emergency_braking : 1);
  }
  const double dt = seconds(options_.interpolation_period);
  history_[static_cast<std::size_t>(ticks_ + 1) % history_size] =
      here + dt * (state_ == ControllerState::emergency_stop
                       ? velocity_
                       : Motors(velocity_ + to_motors(creep_)));
}

/// @return the speed of the period that begins now and ends at `next`.
SimulatedRobot::Motors SimulatedRobot::run_program(Utime next) {
  const Motors before = astray_;
  astray_ += seconds(options_.interpolation_period) * astray_rate_;
  if (options_.program == Program::position_register) {
    loop_.advance(tick_, {speed_ * (speed_limit_ * override_), acceleration_});
    return (loop_.position(next) + astray_ - at_tick(ticks_)) /
           seconds(options_.interpolation_period);
  }
  const Motors velocity = follow(desired(tick_) + before, desired(next) + astray_);
  while (setpoints_.size() > 2 && setpoints_[1].play <= tick_) setpoints_.pop_front();
  return velocity;
}

void SimulatedRobot::run_away(const Joints& rate) {
  astray_rate_ = to_motors(rate);
  if (astray_rate_.isZero()) astray_.setZero();
}

SimulatedRobot::Motors SimulatedRobot::desired(Utime t) const {
  const auto after = std::find_if(setpoints_.begin(), setpoints_.end(),
                                  [&](const Setpoint& s) { return s.play > t; });
  if (after == setpoints_.begin()) return setpoints_.front().motors;
  const auto before = std::prev(after);
  if (after == setpoints_.end()) return before->motors;
  const double s =
      static_cast<double>(t - before->play) / static_cast<double>(after->play - before->play);
  return before->motors + s * (after->motors - before->motors);
}

/// Speed for the next period: that of the desired motion, plus as much towards it as can still be
/// braked.
SimulatedRobot::Motors SimulatedRobot::follow(const Motors& desired_now,
                                              const Motors& desired_next) const {
  const double dt = seconds(options_.interpolation_period);
  const Motors along = (desired_next - desired_now) / dt;
  const Motors behind = desired_now - at_tick(ticks_);
  Motors velocity;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const double a = acceleration_[i];
    const double way = std::abs(behind[i]);
    const double reference = along[i] + std::copysign(brakable_speed(way, a, dt), behind[i]);
    const double max_speed = speed_[i] * speed_limit_ * override_;
    velocity[i] = std::clamp(std::clamp(reference, -max_speed, max_speed), velocity_[i] - a * dt,
                             velocity_[i] + a * dt);
  }
  return velocity;
}

/// All axes slow down in proportion, so that the robot stays on its line.
SimulatedRobot::Motors SimulatedRobot::braked(double factor) const {
  const double dt = seconds(options_.interpolation_period);
  const double periods =
      (velocity_.array().abs() / (factor * dt * acceleration_.array())).maxCoeff();
  if (periods <= 1) return Motors::Zero();
  return velocity_ * (1 - 1 / periods);
}

Utime SimulatedRobot::play_time(int time_ms, Utime now) {
  const int wrap = options_.counter_wrap;
  if (stamped_) {
    int step = (time_ms - last_stamp_ms_) % wrap;
    if (step > wrap / 2) step -= wrap;
    if (step < -wrap / 2) step += wrap;
    stamp_ += static_cast<Utime>(step) * millisecond;
    stamp_offset_ = std::min(stamp_offset_ + offset_relaxation, now - stamp_);
    // A set-point far off its stamp starts a new series.
    if (now - stamp_ - stamp_offset_ > options_.dead_time) stamp_offset_ = now - stamp_;
  } else {
    stamped_ = true;
    stamp_ = static_cast<Utime>(time_ms) * millisecond;
    stamp_offset_ = now - stamp_;
  }
  last_stamp_ms_ = time_ms;
  return stamp_ + stamp_offset_ + options_.dead_time;
}

void SimulatedRobot::take_setpoint(const Joints& joints, int sequence, int time_ms, Utime now) {
  setpoint_pending_ = sequence;
  if (state_ != ControllerState::running) return;
  const bool beyond =
      !std::all_of(joints.begin(), joints.end(), [](double j) { return std::isfinite(j); }) ||
      !kinematics_->limit_violation(joints).empty();
  if (beyond) {
    state_ = ControllerState::fault;
    error_ = robot_error::joint_limit;
    return;
  }
  if (options_.program == Program::position_register) {
    return loop_.write(to_motors(joints), now + options_.dead_time);
  }
  const Utime play = std::max(play_time(time_ms, now), setpoints_.back().play + 1);
  if (play - setpoints_.back().play >= options_.dead_time) {  // not before its time
    setpoints_.push_back({play - resumption, setpoints_.back().motors});
  }
  setpoints_.push_back({play, to_motors(joints)});
}

void SimulatedRobot::set_follow(bool follow) { follow_ = follow; }

void SimulatedRobot::set_speed_limit(double fraction) {
  speed_limit_ = std::clamp(fraction, 0.0, 1.0);
}

void SimulatedRobot::start(Utime now) {
  if (state_ != ControllerState::idle && state_ != ControllerState::held) return;
  if (!estop_closed_ || !fence_closed_ || !follow_ || now - last_heartbeat_ > options_.watchdog) {
    return;
  }
  state_ = ControllerState::running;
  error_ = robot_error::none;
  stamped_ = false;
  setpoints_.assign(1, {now, at_tick(ticks_ + 1)});
  loop_.start(at_tick(ticks_ + 1), now);
}

void SimulatedRobot::hold(int error) {
  if (state_ != ControllerState::running) return;
  state_ = ControllerState::held;
  error_ = error;
}

void SimulatedRobot::reset() {
  if (!estop_closed_ || !fence_closed_) return;
  if (state_ == ControllerState::fault) state_ = ControllerState::idle;
  error_ = robot_error::none;
}

void SimulatedRobot::set_safety(bool estop_closed, bool fence_closed) {
  estop_closed_ = estop_closed;
  fence_closed_ = fence_closed;
  if (!estop_closed) {
    state_ = ControllerState::emergency_stop;
    error_ = robot_error::emergency_stop;
  } else if (state_ == ControllerState::emergency_stop) {
    state_ = ControllerState::fault;  // until RESET
  }
  if (!fence_closed && state_ != ControllerState::emergency_stop) {
    state_ = ControllerState::fault;
    error_ = robot_error::fence;
  }
}

int SimulatedRobot::program_state() const {
  switch (state_) {
    case ControllerState::running:
      return 2;
    case ControllerState::idle:
      return 0;
    default:
      return 1;
  }
}

Joints SimulatedRobot::joints_at(Utime t) const {
  const Utime period = options_.interpolation_period;
  const Utime oldest =
      tick_ - period * std::min<Utime>(ticks_, static_cast<Utime>(history_size) - 2);
  const Utime clamped = std::clamp(t, oldest, tick_ + period);
  std::int64_t index = ticks_ + (clamped - tick_) / period;
  Utime into = (clamped - tick_) % period;
  if (into < 0) {
    into += period;
    --index;
  }
  if (into == 0) return to_joints(at_tick(index));
  const double s = static_cast<double>(into) / static_cast<double>(period);
  return to_joints(at_tick(index) + s * (at_tick(index + 1) - at_tick(index)));
}

}  // namespace berth
