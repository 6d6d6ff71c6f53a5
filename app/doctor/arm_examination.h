// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/doctor/finding.h"
#include "app/doctor/polled_registers.h"
#include "common/bus/clock_map.h"
#include "common/core/cell.h"
#include "drivers/arm/register_map.h"
#include "drivers/arm/snpx_adapter.h"
#include "drivers/devices.h"

namespace berth {

/// One arm's controller, read as its driver reads it, and never written to. The driver reads the
/// controller's table of assignments back through slot 80, which it has to write to: here the
/// contents of the mapped registers are looked at instead.
class ArmExamination {
 public:
  struct Setup {
    ArmRole role = ArmRole::replica;
    ArmDevice device;
    RegisterMap map;
    std::shared_ptr<const ArmKinematics> kinematics;
  };

  ArmExamination(Setup setup, Loop& loop);

  /// The findings after reading for this span.
  std::vector<Finding> findings(Utime span) const;

 private:
  void on_status(const RegisterAnswer& answer);
  void on_command_block(const RegisterAnswer& answer);
  void read_alarm();

  Finding register_map() const;
  Finding tick() const;
  Finding heartbeat() const;
  Finding pose() const;
  Finding state() const;
  /// Register contents that cannot be right, and the assignment that should show them.
  struct Mismatch {
    std::string found;
    std::string assignment;
  };
  std::optional<Mismatch> mismatch() const;
  std::optional<Mismatch> unlike(const char* name, const RegisterField& field, double min,
                                 double max) const;
  std::optional<Mismatch> unlike(const char* name, int address, double value, double min,
                                 double max) const;
  Finding finding(const char* topic) const;

  Setup setup_;
  std::string name_;
  ArmRegisterCodec codec_;
  ControllerClock controller_clock_;
  ClockMap clock_;
  int reads_ = 0;
  std::vector<Word> words_;  // of the newest status read
  ArmReport report_;
  Utime renewed_ = 0;  // when the controller's tick was last seen to have changed
  Utime standstill_ = 0;
  Utime min_step_ = 0;  // between two ticks seen; 0: none was
  int ticks_ = 0;
  int jumps_ = 0;
  int beats_ = 0;  // changes of the controller's own heartbeat
  bool command_read_ = false;
  int host_heartbeat_ = 0;
  int host_beats_ = 0;
  int echoes_ = 0;  // of the set-point's number, while a host writes
  std::string alarm_;
  bool alarm_requested_ = false;
  PolledRegisters controller_;
};

}  // namespace berth
