// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>

#include "common/bus/loop.h"
#include "drivers/arm/register_map.h"
#include "drivers/registers/register_server.h"
#include "drivers/simulated/perturbation.h"
#include "drivers/simulated/simulated_robot.h"
#include "drivers/simulated/snpx_memory.h"

namespace berth {

/// One simulated arm controller behind registers (Modbus). What it reports comes from its encoders
/// and the nominal kinematics; the arm's true place follows from the true joints (encoders less the
/// zero errors).
class SimulatedController {
 public:
  struct Options {
    SimulatedRobot::Options robot;
    int connections = 4;
    Utime idle_timeout = 5 * second;
    Utime report_lag = 2 * millisecond;
    double rotary_quantum = 0;  ///< rad; 0: not quantised
    double linear_quantum = 0;  ///< m
  };

  /// Serves at the address from now on. @throws InputError when it cannot be listened on.
  SimulatedController(const std::string& address, const RegisterMap& map, const PlacedArm& arm,
                      const ArmErrors& errors, Options options, Loop& loop);

  /// True joints, at any time of the last half second up to now.
  Joints true_joints(Utime t);
  ControllerState state();
  int error();
  /// The controller's clock at the start of its current period, ms, wrapped.
  int tick_ms() const;

  /// State of the PLC's E-stop chain.
  void set_safety(bool estop_closed, bool fence_closed);

  /// Its connections and their faults.
  RegisterServer& server() { return *server_; }

  // Faults: each lasts until it is cleared.
  /// The program stops calculating: tick and position stand still in the registers, the arm brakes.
  void freeze(bool frozen);
  void invalidate_joints(bool invalid) { joints_invalid_ = invalid; }
  /// The reported joints wander away from the true ones (rad/s, m/s per joint).
  void drift(const Joints& rate);
  /// A step of the reported joints against the true ones (rad, m).
  void offset(const Joints& offset) { offset_ = offset; }
  /// The arm itself creeps.
  void creep(const Joints& rate);
  /// The program departs from its set-points at this rate.
  void run_away(const Joints& rate);
  /// The pendant's speed override is turned down: 0..1, 1 again afterwards.
  void set_override(double fraction);
  /// Clock and counters start anew, the program is aborted, all connections are gone.
  void reboot();

  SnpxMemory& memory() { return memory_; }

 private:
  void advance();
  void before_read(RegisterTable table, int first, int count);
  void after_write(RegisterTable table, int first, int count);
  void renew_variables();
  /// @return how far the flange has moved since the last time, mm
  double renew_position(const Joints& joints);
  void after_register_write();
  void after_coil_write();
  Joints reported(const Joints& encoders) const;

  const RegisterMap map_;
  const PlacedArm arm_;
  const ArmErrors errors_;
  const Options options_;
  Loop& loop_;
  Utime started_;
  SimulatedRobot robot_;
  SnpxMemory memory_;
  RegisterImage image_;

  int last_sequence_ = 0;
  int last_heartbeat_ = 0;
  int boot_ms_ = 0;                           // the clock's reading at boot
  bool coil_was_[3] = {false, false, false};  // START, HOLD, RESET
  Utime renewed_tick_ = -1;
  Joints renewed_joints_{};
  bool estop_closed_ = true;
  bool fence_closed_ = true;
  bool frozen_ = false;
  bool joints_invalid_ = false;
  Joints drift_rate_{};
  Joints drift_{};
  Joints offset_{};
  Utime drift_since_ = 0;

  std::unique_ptr<RegisterServer> server_;
};

}  // namespace berth
