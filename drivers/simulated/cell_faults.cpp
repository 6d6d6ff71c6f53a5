// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/cell_faults.h"

namespace berth {
namespace {

using Value = FaultTable::Value;

/// Of a Modbus server, whosever.
void add_wire(FaultTable& table, const std::string& device, ModbusServer& server) {
  const auto fault = [&](const char* name, Value kind, double least, double greatest, auto set) {
    table.add({device, name, kind, least, greatest, [&server, set](double v) { set(server, v); },
               [&server, set] { set(server, 0); }});
  };
  const auto moment = [&](const char* name, void (ModbusServer::*happens)()) {
    table.add(
        {device, name, Value::none, 0, 0, [&server, happens](double) { (server.*happens)(); }, {}});
  };
  const auto flag = [&](const char* name, bool ModbusFaults::*member) {
    table.add({device, name, Value::none, 0, 0,
               [&server, member](double) { server.faults().*member = true; },
               [&server, member] { server.faults().*member = false; }});
  };
  flag("silent", &ModbusFaults::silent);
  flag("garbage", &ModbusFaults::garbage);
  fault("exception", Value::number, 1, 11,
        [](ModbusServer& s, double code) { s.faults().exception = static_cast<int>(code); });
  fault("delayed", Value::time, 0, 10,
        [](ModbusServer& s, double delay) { s.faults().delay = utime_from_seconds(delay); });
  moment("half_open", &ModbusServer::half_open);
  moment("drop_connection", &ModbusServer::drop_connections);
}

void add_arm(FaultTable& table, const std::string& device, SimulatedController& arm) {
  const auto flag = [&](const char* name, void (SimulatedController::*set)(bool)) {
    table.add({device, name, Value::none, 0, 0, [&arm, set](double) { (arm.*set)(true); },
               [&arm, set] { (arm.*set)(false); }});
  };
  const auto all_joints = [&](const char* name, Value kind, double most,
                              void (SimulatedController::*set)(const Joints&)) {
    table.add({device, name, kind, -most, most,
               [&arm, set](double value) {
                 Joints joints;
                 joints.fill(value);
                 (arm.*set)(joints);
               },
               [&arm, set] { (arm.*set)({}); }});
  };
  flag("stall", &SimulatedController::freeze);
  flag("invalid_position", &SimulatedController::invalidate_joints);
  all_joints("report_drift", Value::rate, 0.1, &SimulatedController::drift);
  all_joints("report_jump", Value::angle, 0.1, &SimulatedController::offset);
  all_joints("creep", Value::rate, 0.1, &SimulatedController::creep);
  all_joints("runaway", Value::rate, 1, &SimulatedController::run_away);
  table.add({device, "reboot", Value::none, 0, 0, [&arm](double) { arm.reboot(); }, {}});
  add_wire(table, device, arm.server());
}

void add_plc(FaultTable& table, SimulatedPlc& plc) {
  const auto flag = [&](const char* name, void (SimulatedPlc::*set)(bool)) {
    table.add({"plc", name, Value::none, 0, 0, [&plc, set](double) { (plc.*set)(true); },
               [&plc, set] { (plc.*set)(false); }});
  };
  flag("estop", &SimulatedPlc::press_estop);
  flag("fence", &SimulatedPlc::open_fence);
  add_wire(table, "plc", plc.server());
}

void add_lidar(FaultTable& table, SimulatedLidar& lidar) {
  const auto flag = [&](const char* name, bool LidarFaults::*member) {
    table.add({"lidar", name, Value::none, 0, 0,
               [&lidar, member](double) { lidar.faults().*member = true; },
               [&lidar, member] { lidar.faults().*member = false; }});
  };
  const auto level = [&](const char* name, Value value, double least, double greatest,
                         double LidarFaults::*member) {
    table.add({"lidar", name, value, least, greatest,
               [&lidar, member](double v) { lidar.faults().*member = v; },
               [&lidar, member] { lidar.faults().*member = LidarFaults{}.*member; }});
  };
  flag("silent", &LidarFaults::silent);
  flag("blackout", &LidarFaults::blackout);
  level("range_bias", Value::length, -10, 10, &LidarFaults::range_bias);
  level("noise_scale", Value::number, 0, 100, &LidarFaults::noise_scale);
  level("range_noise", Value::number, 0, 100, &LidarFaults::range_noise);
  level("angle_noise", Value::number, 0, 100, &LidarFaults::angle_noise);
  level("dropout", Value::share, 0, 1, &LidarFaults::dropout);
  level("slow", Value::share, 0.01, 1, &LidarFaults::speed);
}

}  // namespace

FaultTable cell_faults(SimulatedController& replica, SimulatedController& sensor, SimulatedPlc& plc,
                       SimulatedLidar& lidar, CellScene& scene) {
  FaultTable table;
  add_lidar(table, lidar);
  add_arm(table, "arm-replica", replica);
  add_arm(table, "arm-sensor", sensor);
  add_plc(table, plc);
  table.add({"target", "occlusion", Value::share, 0, 1,
             [&scene](double share) { scene.set_occlusion(share); },
             [&scene] { scene.set_occlusion(0); }});
  return table;
}

}  // namespace berth
