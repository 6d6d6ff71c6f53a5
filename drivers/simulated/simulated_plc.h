// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>

#include "common/bus/loop.h"
#include "drivers/facility/plc_map.h"
#include "drivers/modbus/modbus_server.h"

namespace berth {

/// The facility's PLC behind Modbus TCP: lamps that take a moment to come up, the E-stop chain and
/// the fence, which it hands on to the arm controllers as the real wires do.
class SimulatedPlc {
 public:
  struct Options {
    int connections = 4;
    Utime idle_timeout = 5 * second;
    Utime lamp_rise = second;  ///< from dark to full
  };
  using SafetyChanged = std::function<void(bool estop_closed, bool fence_closed)>;

  /// @throws InputError when the address cannot be listened on.
  SimulatedPlc(const std::string& address, const PlcMap& map, Options options, Loop& loop,
               SafetyChanged changed);

  void press_estop(bool pressed);
  void open_fence(bool open);
  bool estop_closed() const { return estop_closed_; }
  bool fence_closed() const { return fence_closed_; }

  double sun_lamp() { return level_now(sun_); }
  double albedo_lamp() { return level_now(albedo_); }
  double sun_azimuth() const { return sun_azimuth_; }
  double sun_elevation() const { return sun_elevation_; }

  /// What is wrong with its wire.
  ModbusServer& server() { return server_; }

 private:
  struct Lamp {
    double from = 0;
    double to = 0;
    Utime since = 0;
  };
  double level_now(const Lamp& lamp) const;
  void turn(Lamp& lamp, double level);
  void before_read();
  void after_write();

  PlcMap map_;
  Options options_;
  Loop& loop_;
  Utime started_;
  SafetyChanged changed_;
  bool estop_closed_ = true;
  bool fence_closed_ = true;
  Lamp sun_;
  Lamp albedo_;
  double sun_azimuth_ = 0;
  double sun_elevation_ = 0;
  ModbusImage image_;
  ModbusServer server_;
};

}  // namespace berth
