// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <string>

#include "drivers/arm/adapter.h"
#include "drivers/arm/arm_wire.h"
#include "drivers/arm/assignment_check.h"
#include "drivers/arm/controller_clock.h"
#include "drivers/devices.h"
#include "drivers/registers/register_link.h"

namespace berth {

/// A Fanuc controller with HMI Device (SNPX) over Modbus. It holds two links, one for reads and one
/// for set-points. A HOLD goes out over one that is free, where none is over each that is up. Ready
/// once the controller's assignments have been read back and agree with the map.
class SnpxAdapter final : public ArmAdapter {
 public:
  SnpxAdapter(const ArmDevice& device, const RegisterMap& map, const ArmKinematics& kinematics,
              Loop& loop);
  ~SnpxAdapter() override;
  SnpxAdapter(const SnpxAdapter&) = delete;
  SnpxAdapter& operator=(const SnpxAdapter&) = delete;

  void start(Events events) override;
  const std::string& name() const override { return options_.address; }
  const Capabilities& capabilities() const override { return capabilities_; }
  bool ready() const override { return ready_; }
  bool reachable() const override { return reader_->connected() || writer_->connected(); }
  bool takes_setpoints() const override { return writer_->connected(); }
  bool busy() const override { return !writer_->idle(); }
  void poll() override;
  void send(const ArmOrder& order, Done done) override;
  int hold(Done done) override { return pulse(map().hold_coil, done); }
  void release() override;
  void run() override { pulse(map().start_coil, {}); }
  void reset() override { pulse(map().reset_coil, {}); }

 private:
  const RegisterMap& map() const { return wire_.map(); }
  void on_connection(bool connected, const std::string& reason);
  void check_assignments();
  void on_checked(AssignmentCheck::Result result, const std::string& text);
  void on_status(const RegisterAnswer& answer);
  void read_alarm(int error);
  int pulse(int coil, const Done& done);
  int write_coil(int coil, bool on, const Done& done);

  ArmWire wire_;
  RegisterLink::Options options_;
  Capabilities capabilities_;
  Loop& loop_;
  Events events_;
  std::unique_ptr<RegisterLink> reader_;
  std::unique_ptr<RegisterLink> writer_;
  std::shared_ptr<AssignmentCheck> check_;
  Loop::TimerId recheck_timer_ = 0;
  bool ready_ = false;  // connected and the map is right
  ControllerClock clock_;
  int heartbeat_ = 0;
  int alarm_of_ = 0;                           // the error whose alarm was asked for
  std::string alarm_;                          // its text, once read
  std::map<int, Loop::TimerId> pulse_timers_;  // by coil
};

}  // namespace berth
