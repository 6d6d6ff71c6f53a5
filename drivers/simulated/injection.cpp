// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/injection.h"

#include <stdexcept>
#include <utility>

namespace berth {
void FaultTable::set(const std::string& device, const std::string& name,
                     std::function<void(double)> begin, std::function<void()> end) {
  std::size_t index = 0;
  const std::string unknown = unknown_fault(device, name, index);
  if (!unknown.empty()) throw std::logic_error(unknown);
  effects_[index] = {std::move(begin), std::move(end)};
}

std::vector<std::string> FaultTable::unset() const {
  std::vector<std::string> missing;
  for (std::size_t i = 0; i < effects_.size(); ++i) {
    const FaultKind& kind = fault_kinds()[i];
    if (!effects_[i].begin) missing.push_back(kind.device + ": " + kind.name);
  }
  return missing;
}

std::string FaultTable::inject(const std::string& device, const std::string& name, double value,
                               double duration, Utime now) {
  std::size_t index = 0;
  if (const std::string unknown = unknown_fault(device, name, index); !unknown.empty())
    return unknown;
  const FaultKind& kind = fault_kinds()[index];
  if (const std::string wrong = wrong_fault_value(kind, value); !wrong.empty()) return wrong;
  constexpr double max_duration = 1e6;
  if (!(duration >= 0 && duration <= max_duration)) {
    return "the duration of '" + name + "' is not within 0 to 1000000 s";
  }
  effects_[index].begin(value);
  if (effects_[index].end) {
    active_[index] = {value, duration > 0 ? now + utime_from_seconds(duration) : 0};
  }
  return "";
}

std::string FaultTable::clear(const std::string& device, const std::string& name) {
  if (name.empty()) {
    bool known = false;
    for (std::size_t i = 0; i < effects_.size(); ++i) {
      if (fault_kinds()[i].device != device) continue;
      known = true;
      end(i);
    }
    std::size_t index = 0;
    return known ? "" : unknown_fault(device, name, index);
  }
  std::size_t index = 0;
  const std::string unknown = unknown_fault(device, name, index);
  if (unknown.empty()) end(index);
  return unknown;
}

void FaultTable::end(std::size_t index) {
  if (active_.erase(index) > 0) effects_[index].end();
}

void FaultTable::clear_all() {
  for (std::size_t i = 0; i < effects_.size(); ++i) end(i);
}

bool FaultTable::advance(Utime now) {
  std::vector<std::size_t> over;
  for (const auto& [index, active] : active_) {
    if (active.until != 0 && active.until <= now) over.push_back(index);
  }
  for (const std::size_t index : over) end(index);
  return !over.empty();
}

Utime FaultTable::next_change() const {
  Utime next = 0;
  for (const auto& [index, active] : active_) {
    if (active.until != 0 && (next == 0 || active.until < next)) next = active.until;
  }
  return next;
}

std::vector<std::string> FaultTable::active() const {
  std::vector<std::string> list;
  for (const auto& [index, active] : active_) {
    const FaultKind& kind = fault_kinds()[index];
    list.push_back(kind.device + ": " + kind.name + text_of(kind.value, active.value));
  }
  return list;
}

namespace {

/// Faults of any device's Modbus server.
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
