// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/injection.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace berth {
namespace {

/// The value as a person would say it; with " " before it, or nothing.
std::string shown(FaultTable::Value kind, double value) {
  char text[48] = "";
  switch (kind) {
    case FaultTable::Value::none:
      break;
    case FaultTable::Value::share:
      std::snprintf(text, sizeof text, " %.3g %%", 100 * value);
      break;
    case FaultTable::Value::number:
      std::snprintf(text, sizeof text, " %.4g", value);
      break;
    case FaultTable::Value::length:
      std::snprintf(text, sizeof text, " %.4g mm", 1e3 * value);
      break;
    case FaultTable::Value::angle:
      std::snprintf(text, sizeof text, " %.4g rad", value);
      break;
    case FaultTable::Value::rate:
      std::snprintf(text, sizeof text, " %.4g rad/s", value);
      break;
    case FaultTable::Value::time:
      std::snprintf(text, sizeof text, " %.4g s", value);
      break;
  }
  return text;
}

void append(std::string& list, const std::string& word) {
  if (!list.empty()) list += ", ";
  list += word;
}

}  // namespace

std::string FaultTable::find(const std::string& device, const std::string& name,
                             std::size_t& index) const {
  std::string devices;
  std::string names;
  for (std::size_t i = 0; i < faults_.size(); ++i) {
    if (i == 0 || faults_[i].device != faults_[i - 1].device) append(devices, faults_[i].device);
    if (faults_[i].device != device) continue;
    if (faults_[i].name == name) {
      index = i;
      return "";
    }
    append(names, faults_[i].name);
  }
  if (names.empty()) return "no device '" + device + "' can fail; devices are: " + devices;
  return "'" + device + "' knows no fault '" + name + "'; its faults are: " + names;
}

std::string FaultTable::inject(const std::string& device, const std::string& name, double value,
                               double duration, Utime now) {
  std::size_t index = 0;
  if (const std::string unknown = find(device, name, index); !unknown.empty()) return unknown;
  const Fault& fault = faults_[index];
  if (!(value >= fault.least && value <= fault.greatest)) {
    if (fault.value == Value::none) return "'" + name + "' takes no value";
    return "'" + name + "' takes" + shown(fault.value, fault.least) + " to" +
           shown(fault.value, fault.greatest) + ", found" + shown(fault.value, value);
  }
  constexpr double longest = 1e6;
  if (!(duration >= 0 && duration <= longest)) {
    return "the duration of '" + name + "' is not within 0 to 1000000 s";
  }
  fault.begin(value);
  if (fault.end) {
    active_[index] = {value, duration > 0 ? now + utime_from_seconds(duration) : 0};
  }
  return "";
}

std::string FaultTable::clear(const std::string& device, const std::string& name) {
  if (name.empty()) {
    bool known = false;
    for (std::size_t i = 0; i < faults_.size(); ++i) {
      if (faults_[i].device != device) continue;
      known = true;
      end(i);
    }
    std::size_t index = 0;
    return known ? "" : find(device, name, index);
  }
  std::size_t index = 0;
  const std::string unknown = find(device, name, index);
  if (unknown.empty()) end(index);
  return unknown;
}

void FaultTable::end(std::size_t index) {
  if (active_.erase(index) > 0) faults_[index].end();
}

void FaultTable::clear_all() {
  for (std::size_t i = 0; i < faults_.size(); ++i) end(i);
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
    const Fault& fault = faults_[index];
    list.push_back(fault.device + ": " + fault.name + shown(fault.value, active.value));
  }
  return list;
}

}  // namespace berth
