// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>

#include "common/bus/loop.h"
#include "common/core/pose.h"
#include "drivers/facility/plc_map.h"
#include "drivers/registers/register_server.h"

namespace berth {

/// The facility's PLC behind registers (Modbus): lamps that take a moment to come up and to turn,
/// the E-stop chain and the fence, which it passes on to the arm controllers as the hard wires do.
class SimulatedPlc {
 public:
  struct Options {
    int connections = 4;
    Utime idle_timeout = 5 * second;
    Utime lamp_rise = second;           ///< from dark to full
    double lamp_turn = radians(180.0);  ///< rad/s, of azimuth and of elevation
  };
  using SafetyChanged = std::function<void(bool estop_closed, bool fence_closed)>;

  /// @throws InputError when the address cannot be listened on.
  SimulatedPlc(const std::string& address, const PlcMap& map, Options options, Loop& loop,
               SafetyChanged changed);

  void press_estop(bool pressed);
  void open_fence(bool open);
  bool estop_closed() const { return estop_closed_; }
  bool fence_closed() const { return fence_closed_; }

  double sun_lamp() const { return sun_.at(loop_.now()); }
  double albedo_lamp() const { return albedo_.at(loop_.now()); }
  double sun_azimuth() const { return azimuth_.at(loop_.now()); }
  double sun_elevation() const { return elevation_.at(loop_.now()); }

  /// Its connections and their faults.
  RegisterServer& server() { return *server_; }

 private:
  /// A level or an angle on its way at a constant rate.
  struct Ramp {
    double rate = 0;  ///< a second
    double from = 0;
    double to = 0;
    Utime since = 0;

    double at(Utime now) const;
    void go(double value, Utime now);
  };
  void before_read();
  void after_write();

  PlcMap map_;
  Options options_;
  Loop& loop_;
  Utime started_;
  SafetyChanged changed_;
  bool estop_closed_ = true;
  bool fence_closed_ = true;
  Ramp sun_;
  Ramp albedo_;
  Ramp azimuth_;
  Ramp elevation_;
  RegisterImage image_;
  std::unique_ptr<RegisterServer> server_;
};

}  // namespace berth
