// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/LU>
#include <array>
#include <deque>
#include <memory>
#include <string>

#include "common/bus/loop.h"
#include "common/core/arm_kinematics.h"
#include "drivers/arm/register_map.h"
#include "drivers/simulated/position_register_loop.h"

namespace berth {

/// Why a simulated controller stopped; its register R[7].
namespace robot_error {
inline constexpr int none = 0;
inline constexpr int host_heartbeat = 101;  ///< the host's heartbeat stopped: held
inline constexpr int joint_limit = 102;     ///< a set-point beyond a limit
inline constexpr int emergency_stop = 103;
inline constexpr int fence = 104;
const char* text(int error);
}  // namespace robot_error

/// A robot and its motion program, without wire: set-points in, joints out. It moves on the grid of
/// the controller's interpolation period and is computed on demand: call advance() to the present
/// before anything else. Joints as the controller counts them (its encoders).
///
/// Two kinds of program. One plays set-points out a dead time after they came, interpolated between
/// their stamps, and clips each motor's speed and acceleration. The other ignores stamps: it moves
/// to a position register in a loop (position_register_loop.h), which holds each set-point a dead
/// time after it came.
class SimulatedRobot {
 public:
  enum class Program { interpolating, position_register };
  struct Options {
    Program program = Program::interpolating;
    int cnt = 100;  ///< of position_register: termination of its motions
    Utime interpolation_period = 8 * millisecond;
    Utime dead_time = 150 * millisecond;
    Utime watchdog = 150 * millisecond;
    double emergency_braking = 2;  ///< times the joints' own acceleration
    int counter_wrap = 1 << 24;    ///< of set-point times, ms
  };

  SimulatedRobot(std::shared_ptr<const ArmKinematics> kinematics, Options options,
                 const Joints& start, Utime now);

  void advance(Utime now);

  /// What the host writes; each after advance(now).
  void take_setpoint(const Joints& joints, int sequence, int time_ms, Utime now);
  void take_heartbeat(Utime now) { last_heartbeat_ = now; }
  void set_follow(bool follow);
  void set_speed_limit(double fraction);
  /// The pendant's: 0..1 of every speed.
  void set_override(double fraction) { override_ = fraction; }
  void start(Utime now);
  void hold(int error = robot_error::none);
  void reset();
  /// State of the PLC's E-stop chain.
  void set_safety(bool estop_closed, bool fence_closed);

  ControllerState state() const { return state_; }
  int error() const { return error_; }
  /// 0 aborted, 1 paused, 2 running.
  int program_state() const;
  int setpoint_taken() const { return setpoint_taken_; }
  double speed_limit() const { return speed_limit_; }
  double speed_override() const { return override_; }

  /// Start of the last interpolation period begun.
  Utime tick() const { return tick_; }
  std::int64_t ticks() const { return ticks_; }
  /// At any time of the last half second, up to the end of the current period.
  Joints joints_at(Utime t) const;

  // Faults, for tests: each lasts until it is cleared.
  /// The program stops calculating; the robot brakes.
  void freeze(bool frozen) { frozen_ = frozen; }
  /// A drive's fault: the axes creep by themselves (rad/s, m/s), whatever the program does; an
  /// emergency stop, which cuts the power and lets the brakes fall, ends it.
  void creep(const Joints& rate) { creep_ = rate; }
  /// The program's fault: while it runs, it departs from its set-points at this rate (rad/s, m/s).
  void run_away(const Joints& rate);

 private:
  using Motors = Eigen::Matrix<double, 6, 1>;
  struct Setpoint {
    Utime play = 0;
    Motors motors;
  };
  static constexpr std::size_t history_size = 64;  // periods: half a second

  void step();
  Motors desired(Utime t) const;
  Motors follow(const Motors& desired_now, const Motors& desired_next) const;
  Motors run_program(Utime next);
  Motors braked(double factor) const;
  Motors to_motors(const Joints& joints) const;
  Joints to_joints(const Motors& motors) const;
  const Motors& at_tick(std::int64_t tick) const {
    return history_[static_cast<std::size_t>(tick) % history_size];
  }
  Utime play_time(int time_ms, Utime now);

  std::shared_ptr<const ArmKinematics> kinematics_;
  Options options_;
  Eigen::Matrix<double, 6, 6> motors_of_joints_;
  Eigen::Matrix<double, 6, 6> joints_of_motors_;
  Motors speed_;  // limits
  Motors acceleration_;

  ControllerState state_ = ControllerState::idle;
  int error_ = robot_error::none;
  bool follow_ = false;
  bool estop_closed_ = true;
  bool fence_closed_ = true;
  bool frozen_ = false;
  Joints creep_{};
  Motors astray_rate_ = Motors::Zero();  // of the motors
  Motors astray_ = Motors::Zero();       // from the set-points
  double speed_limit_ = 1;
  double override_ = 1;
  Utime last_heartbeat_ = 0;

  std::deque<Setpoint> setpoints_;  // of interpolating
  PositionRegisterLoop loop_;       // of position_register
  int setpoint_pending_ = 0;
  int setpoint_taken_ = 0;
  bool stamped_ = false;
  int last_stamp_ms_ = 0;
  Utime stamp_ = 0;         // unwrapped
  Utime stamp_offset_ = 0;  // arrival minus stamp of the least delayed set-point

  Utime tick_ = 0;
  std::int64_t ticks_ = 0;  // history_[ticks_]: at tick_; history_[ticks_ + 1]: one period on
  Motors velocity_ = Motors::Zero();
  std::array<Motors, history_size> history_;
};

}  // namespace berth
