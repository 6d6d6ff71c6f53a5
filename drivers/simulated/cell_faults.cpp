// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/cell_faults.h"

#include <stdexcept>

namespace berth {
namespace {

/// Of a Modbus server, whosever.
void add_wire(FaultTable& table, const std::string& device, RegisterServer& server) {
  const auto level = [&](const char* name, auto set) {
    table.set(
        device, name, [&server, set](double v) { set(server, v); },
        [&server, set] { set(server, 0); });
  };
  const auto moment = [&](const char* name, void (RegisterServer::*happens)()) {
    table.set(device, name, [&server, happens](double) { (server.*happens)(); }, {});
  };
  const auto flag = [&](const char* name, bool RegisterFaults::*member) {
    table.set(
        device, name, [&server, member](double) { server.faults().*member = true; },
        [&server, member] { server.faults().*member = false; });
  };
  flag("silent", &RegisterFaults::silent);
  flag("garbage", &RegisterFaults::garbage);
  level("exception",
        [](RegisterServer& s, double code) { s.faults().exception = static_cast<int>(code); });
  level("delayed",
        [](RegisterServer& s, double delay) { s.faults().delay = utime_from_seconds(delay); });
  moment("half_open", &RegisterServer::half_open_connections);
  moment("drop_connection", &RegisterServer::drop_connections);
}

void add_arm(FaultTable& table, const std::string& device, SimulatedController& arm) {
  const auto flag = [&](const char* name, void (SimulatedController::*set)(bool)) {
    table.set(
        device, name, [&arm, set](double) { (arm.*set)(true); },
        [&arm, set] { (arm.*set)(false); });
  };
  const auto all_joints = [&](const char* name, void (SimulatedController::*set)(const Joints&)) {
    table.set(
        device, name,
        [&arm, set](double value) {
          Joints joints;
          joints.fill(value);
          (arm.*set)(joints);
        },
        [&arm, set] { (arm.*set)({}); });
  };
  flag("stall", &SimulatedController::freeze);
  flag("invalid_position", &SimulatedController::invalidate_joints);
  all_joints("report_drift", &SimulatedController::drift);
  all_joints("report_jump", &SimulatedController::offset);
  all_joints("creep", &SimulatedController::creep);
  all_joints("runaway", &SimulatedController::run_away);
  table.set(
      device, "override", [&arm](double fraction) { arm.set_override(fraction); },
      [&arm] { arm.set_override(1); });
  table.set(device, "reboot", [&arm](double) { arm.reboot(); }, {});
  add_wire(table, device, arm.server());
}

void add_plc(FaultTable& table, SimulatedPlc& plc) {
  const auto flag = [&](const char* name, void (SimulatedPlc::*set)(bool)) {
    table.set(
        "plc", name, [&plc, set](double) { (plc.*set)(true); }, [&plc, set] { (plc.*set)(false); });
  };
  flag("estop", &SimulatedPlc::press_estop);
  flag("fence", &SimulatedPlc::open_fence);
  add_wire(table, "plc", plc.server());
}

void add_lidar(FaultTable& table, SimulatedLidar& lidar) {
  const auto flag = [&](const char* name, bool LidarFaults::*member) {
    table.set(
        "lidar", name, [&lidar, member](double) { lidar.faults().*member = true; },
        [&lidar, member] { lidar.faults().*member = false; });
  };
  const auto level = [&](const char* name, double LidarFaults::*member) {
    table.set(
        "lidar", name, [&lidar, member](double v) { lidar.faults().*member = v; },
        [&lidar, member] { lidar.faults().*member = LidarFaults{}.*member; });
  };
  flag("silent", &LidarFaults::silent);
  flag("blackout", &LidarFaults::blackout);
  level("range_bias", &LidarFaults::range_bias);
  level("noise_scale", &LidarFaults::noise_scale);
  level("range_noise", &LidarFaults::range_noise);
  level("angle_noise", &LidarFaults::angle_noise);
  level("dropout", &LidarFaults::dropout);
  level("slow", &LidarFaults::speed);
}

}  // namespace

FaultTable cell_faults(SimulatedController& replica, SimulatedController& sensor, SimulatedPlc& plc,
                       SimulatedLidar& lidar, CellScene& scene) {
  FaultTable table;
  add_lidar(table, lidar);
  add_arm(table, "arm-replica", replica);
  add_arm(table, "arm-sensor", sensor);
  add_plc(table, plc);
  table.set(
      "target", "occlusion", [&scene](double share) { scene.set_occlusion(share); },
      [&scene] { scene.set_occlusion(0); });
  for (const std::string& missing : table.unset()) throw std::logic_error("no effect: " + missing);
  return table;
}

}  // namespace berth
