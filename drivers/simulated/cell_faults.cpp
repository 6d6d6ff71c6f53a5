// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/cell_faults.h"

namespace berth {
namespace {

using Value = FaultTable::Value;

void add_arm(FaultTable& table, const std::string& device, SimulatedController& arm) {
  const auto all_joints = [](double rate) {
    Joints joints;
    joints.fill(rate);
    return joints;
  };
  const auto flag = [&](const char* name, auto set) {
    table.add({device, name, Value::none, 0, 0, [&arm, set](double) { set(arm, true); },
               [&arm, set] { set(arm, false); }});
  };
  const auto moment = [&](const char* name, auto happens) {
    table.add({device, name, Value::none, 0, 0, [&arm, happens](double) { happens(arm); }, {}});
  };
  flag("stall", [](SimulatedController& a, bool on) { a.freeze(on); });
  flag("silent", [](SimulatedController& a, bool on) { a.silence(on); });
  flag("invalid_position", [](SimulatedController& a, bool on) { a.invalidate_joints(on); });
  table.add({device, "report_drift", Value::rate, -0.1, 0.1,
             [&arm, all_joints](double rate) { arm.drift(all_joints(rate)); },
             [&arm] { arm.drift({}); }});
  table.add({device, "creep", Value::rate, -0.1, 0.1,
             [&arm, all_joints](double rate) { arm.run_away(all_joints(rate)); },
             [&arm] { arm.run_away({}); }});
  moment("drop_connection", [](SimulatedController& a) { a.drop_connections(); });
  moment("reboot", [](SimulatedController& a) { a.reboot(); });
}

void add_plc(FaultTable& table, SimulatedPlc& plc) {
  const auto flag = [&](const char* name, auto set) {
    table.add({"plc", name, Value::none, 0, 0, [&plc, set](double) { set(plc, true); },
               [&plc, set] { set(plc, false); }});
  };
  flag("silent", [](SimulatedPlc& p, bool on) { p.silence(on); });
  flag("estop", [](SimulatedPlc& p, bool on) { p.press_estop(on); });
  flag("fence", [](SimulatedPlc& p, bool on) { p.open_fence(on); });
  const auto later = [&](const char* name, auto set) {
    table.add({"plc", name, Value::delay, 0, 3600, [&plc, set](double) { set(plc, true); },
               [&plc, set] { set(plc, false); }});
  };
  later("estop_after", [](SimulatedPlc& p, bool on) { p.press_estop(on); });
  later("fence_after", [](SimulatedPlc& p, bool on) { p.open_fence(on); });
  table.add({"plc",
             "drop_connection",
             Value::none,
             0,
             0,
             [&plc](double) { plc.drop_connections(); },
             {}});
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
