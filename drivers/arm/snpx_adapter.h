// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/loop.h"
#include "drivers/arm/adapter.h"
#include "drivers/arm/register_map.h"
#include "drivers/devices.h"
#include "drivers/registers/register_link.h"

namespace berth {

/// A controller's tick, unwrapped.
class ControllerClock {
 public:
  explicit ControllerClock(int wrap) : wrap_(wrap) {}

  /// tick_ms: from the registers. @return us, of the controller's clock
  Utime add(int tick_ms) {
    const int step = ((tick_ms - tick_ms_) % wrap_ + wrap_) % wrap_;
    time_ = known_ ? time_ + step * millisecond : tick_ms * millisecond;
    tick_ms_ = tick_ms;
    known_ = true;
    return time_;
  }
  void clear() { known_ = false; }

 private:
  int wrap_;
  bool known_ = false;
  int tick_ms_ = 0;
  Utime time_ = 0;
};

/// Reads a controller's assignments back through slot 80 and compares them with the map: each
/// entry's four fields are shown at the peephole, one after another.
class AssignmentCheck : public std::enable_shared_from_this<AssignmentCheck> {
 public:
  enum class Result {
    agrees,
    differs,      ///< the text names slot, field and both values
    not_offered,  ///< the controller has no bootstrap window: nothing was compared
    failed,       ///< no connection; the text gives the reason
  };
  using Done = std::function<void(Result, const std::string& text)>;

  /// link and map must outlive it; once released by its holder it makes no calls.
  AssignmentCheck(RegisterLink& link, const RegisterMap& map, Done done)
      : link_(link), map_(map), done_(std::move(done)) {}
  void start() { next(); }

 private:
  enum class FieldKind { address, size, name, multiply };
  static constexpr int fields = 4;

  void next();
  void on_shown(const RegisterAnswer& answer);
  void on_window(const RegisterAnswer& answer);
  void read_value();
  void on_value(const RegisterAnswer& answer);
  void finish(Result result, const std::string& text);
  const SnpxAssignment& assignment() const;
  FieldKind field() const;

  RegisterLink& link_;
  const RegisterMap& map_;
  Done done_;
  std::size_t step_ = 0;  // assignment * 4 + field
  std::vector<Word> shown_;
};

/// A Fanuc controller with HMI Device (SNPX) over Modbus. It holds two links, one for reads and one
/// for set-points. A HOLD goes out over an idle one; where none is, over each that is up. Ready
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
  const RegisterMap& map() const { return codec_.map(); }
  void on_connection(bool connected, const std::string& reason);
  void check_assignments();
  void on_checked(AssignmentCheck::Result result, const std::string& text);
  void on_status(const RegisterAnswer& answer);
  void read_alarm(int error);
  int pulse(int coil, const Done& done);
  int write_coil(int coil, bool on, const Done& done);

  ArmRegisterCodec codec_;
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
  int alarm_of_ = 0;                           // the error whose alarm text was requested
  std::string alarm_;                          // its text, once read
  std::map<int, Loop::TimerId> pulse_timers_;  // by coil
};

}  // namespace berth
