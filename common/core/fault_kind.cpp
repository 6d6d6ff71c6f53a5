// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/fault_kind.h"

#include <cstdio>

namespace berth {
namespace {

/// Faults of any device's Modbus server.
void add_wire(std::vector<FaultKind>& kinds, const std::string& device) {
  kinds.push_back({device, "silent"});
  kinds.push_back({device, "garbage"});
  kinds.push_back({device, "exception", FaultValue::number, 1, 11});
  kinds.push_back({device, "delayed", FaultValue::time, 0, 10});
  kinds.push_back({device, "half_open"});
  kinds.push_back({device, "drop_connection"});
}

void add_arm(std::vector<FaultKind>& kinds, const std::string& device) {
  kinds.push_back({device, "stall"});
  kinds.push_back({device, "invalid_position"});
  kinds.push_back({device, "report_drift", FaultValue::rate, -0.1, 0.1});
  kinds.push_back({device, "report_jump", FaultValue::angle, -0.1, 0.1});
  kinds.push_back({device, "creep", FaultValue::rate, -0.1, 0.1});
  kinds.push_back({device, "runaway", FaultValue::rate, -1, 1});
  kinds.push_back({device, "override", FaultValue::share, 0.01, 1});
  kinds.push_back({device, "reboot"});
  add_wire(kinds, device);
}

std::vector<FaultKind> all_kinds() {
  std::vector<FaultKind> kinds = {
      {"lidar", "silent"},
      {"lidar", "blackout"},
      {"lidar", "range_bias", FaultValue::length, -10, 10},
      {"lidar", "noise_scale", FaultValue::number, 0, 100},
      {"lidar", "range_noise", FaultValue::number, 0, 100},
      {"lidar", "angle_noise", FaultValue::number, 0, 100},
      {"lidar", "dropout", FaultValue::share, 0, 1},
      {"lidar", "slow", FaultValue::share, 0.01, 1},
  };
  add_arm(kinds, "arm-replica");
  add_arm(kinds, "arm-sensor");
  kinds.push_back({"plc", "estop"});
  kinds.push_back({"plc", "fence"});
  add_wire(kinds, "plc");
  kinds.push_back({"target", "occlusion", FaultValue::share, 0, 1});
  return kinds;
}

void append(std::string& list, const std::string& word) {
  if (!list.empty()) list += ", ";
  list += word;
}

}  // namespace

const std::vector<FaultKind>& fault_kinds() {
  static const std::vector<FaultKind> kinds = all_kinds();
  return kinds;
}

std::string unknown_fault(const std::string& device, const std::string& name, std::size_t& index) {
  const std::vector<FaultKind>& kinds = fault_kinds();
  std::string devices;
  std::string names;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (i == 0 || kinds[i].device != kinds[i - 1].device) append(devices, kinds[i].device);
    if (kinds[i].device != device) continue;
    if (kinds[i].name == name) {
      index = i;
      return "";
    }
    append(names, kinds[i].name);
  }
  if (names.empty()) return "no device '" + device + "' can fail; devices are: " + devices;
  return "'" + device + "' knows no fault '" + name + "'; its faults are: " + names;
}

std::string wrong_fault_value(const FaultKind& kind, double value) {
  if (value >= kind.min && value <= kind.max) return "";
  if (kind.value == FaultValue::none) return "'" + kind.name + "' takes no value";
  return "'" + kind.name + "' takes" + text_of(kind.value, kind.min) + " to" +
         text_of(kind.value, kind.max) + ", found" + text_of(kind.value, value);
}

std::string text_of(FaultValue value, double size) {
  char text[48] = "";
  switch (value) {
    case FaultValue::none:
      break;
    case FaultValue::share:
      std::snprintf(text, sizeof text, " %.3g %%", 100 * size);
      break;
    case FaultValue::number:
      std::snprintf(text, sizeof text, " %.4g", size);
      break;
    case FaultValue::length:
      std::snprintf(text, sizeof text, " %.4g mm", 1e3 * size);
      break;
    case FaultValue::angle:
      std::snprintf(text, sizeof text, " %.4g rad", size);
      break;
    case FaultValue::rate:
      std::snprintf(text, sizeof text, " %.4g rad/s", size);
      break;
    case FaultValue::time:
      std::snprintf(text, sizeof text, " %.4g s", size);
      break;
  }
  return text;
}

}  // namespace berth
