// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/arm_command_t.hpp>
#include <berth/arm_state_t.hpp>
#include <memory>
#include <optional>
#include <string>

#include "common/bus/clock_map.h"
#include "common/bus/commands.h"
#include "common/bus/node.h"
#include "common/core/cell.h"
#include "common/core/run_setup.h"
#include "drivers/arm/adapter.h"
#include "drivers/arm/report_evaluation.h"
#include "drivers/devices.h"

namespace berth {

/// The driver of one arm controller: publishes every status read as ARM_STATE, writes the newest
/// set-point of ARM_COMMAND at its own rate, passes HOLD, RESET and START on at once.
///
/// A HOLD is repeated until the controller has acknowledged it; when the connection for reports or
/// that for set-points is lost the arm is held over the other. It moves nothing for a command of
/// another session, one that has expired or one that came before a newer; it follows set-points
/// only between a START and the next HOLD, the first of them near the arm's present joints and each
/// next one as near as the joints' speed allows; it holds the arm by itself when set-points stop
/// coming.
///
/// A HOLD of any sender is obeyed: of any session, expired, overtaken. A START follows a copy of
/// the HOLD that it supersedes: repetitions of that HOLD, and of those obeyed before it, are not
/// obeyed again; all others are. A HOLD of another session is superseded only after the testbed has
/// answered it with a new one of its own.
class ArmNode final : public Node {
 public:
  struct Setup {
    ArmRole role = ArmRole::replica;
    ArmDevice device;
    std::shared_ptr<const ArmKinematics> kinematics;
  };
  ArmNode(NodeSetup node, Setup setup, std::unique_ptr<ArmAdapter> adapter, Bus& bus, Loop& loop);
  ~ArmNode() override;

 private:
  /// Counts of events per second, for NODE_STATUS.
  struct Statistics {
    int reads = 0;
    int writes = 0;
    double interval_sum = 0;
    double interval_square_sum = 0;
    double max_round_trip = 0;
  };

  void on_change(ArmAdapter::Change change, const std::string& text);
  void poll();
  void on_missed(const std::string& error, bool refused);
  void on_report(const ArmReport& report);
  void on_command(const arm_command_t& command);
  void on_hold(const arm_command_t& command);
  bool newer(const arm_command_t& command);
  void stream(const arm_command_t& command);
  void start();
  void hold();
  void hold_by_itself(const std::string& code, const std::string& text);
  void stop_following();
  void write_setpoint();
  void write_order();
  void publish_offline();
  void publish(arm_state_t& state);
  void show_statistics();
  /// Empty, or why the set-point is not to be followed.
  std::string jump(const arm_command_t& command) const;
  /// Publishes the same warning at most once a second.
  void warn(const std::string& code, const std::string& text);

  Setup arm_;
  std::unique_ptr<ArmAdapter> adapter_;
  std::string name_;
  std::string state_channel_;
  ClockMap clock_;  // of ArmReport::controller_time
  std::string offline_reason_ = "not connected yet";
  std::string wrong_setup_;       // of the controller; empty: as configured
  std::string setpoints_closed_;  // why set-points do not come through; empty: they do

  bool read_under_way_ = false;
  arm_state_t state_{};  // last published
  ArmReport report_;
  bool have_report_ = false;
  FollowingError following_error_;
  int unchanged_reads_ = 0;  // with the same controller time
  Utime last_published_ = 0;

  ArmOrder order_;
  bool have_order_ = false;
  bool following_ = false;
  bool start_pending_ = false;  // requested, the controller does not run yet
  bool start_pulsed_ = false;
  bool streamed_ = false;  // a set-point came since START
  bool hold_requested_ = false;
  bool hold_written_ = false;      // the controller has acknowledged it
  int hold_writes_under_way_ = 0;  // and not answered yet
  SeenCommands holds_;
  std::optional<std::int64_t> held_by_session_;  // another one, whose HOLD is in force
  Utime started_ = 0;
  Utime hold_repeated_ = 0;
  Utime setpoint_received_ = 0;
  Utime setpoint_expires_ = 0;
  std::int64_t last_command_seq_ = 0;
  Utime last_command_received_ = 0;
  std::string last_warning_;
  Utime warned_at_ = 0;

  std::int64_t reads_ = 0;
  std::int64_t reads_missed_ = 0;
  std::int64_t samples_not_placed_ = 0;
  std::int64_t writes_missed_ = 0;
  Statistics statistics_;

  Loop::TimerId poll_timer_;
  Loop::TimerId write_timer_;
  Loop::TimerId statistics_timer_;
};

/// The channels of one arm.
std::string arm_state_channel(ArmRole role);
std::string arm_command_channel(ArmRole role);

/// Reads devices.yaml, the register map and the arm of the run's layout. @throws InputError.
std::unique_ptr<Node> make_arm_node(NodeSetup node, const RunSetup& run, ArmRole role, Bus& bus,
                                    Loop& loop);

}  // namespace berth
