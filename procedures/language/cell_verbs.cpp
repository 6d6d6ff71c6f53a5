// SPDX-License-Identifier: BSD-3-Clause
// Verbs for lamps, and for faults of a simulated cell.
#include <algorithm>

#include "common/core/fault_kind.h"
#include "procedures/language/parameters.h"
#include "procedures/language/verbs.h"

namespace berth::procedures {
namespace {

void read_lamp(Config& config, const std::string& key, double& value) {
  config.optional(key, value, within(0, 1));
}

Read read_lights(Config& config) { return {read_lamps(config, {}), 20}; }

/// Dimensions that a fault's value may have: of all joints at once, those that turn and those that
/// slide.
std::vector<Dimension> dimensions_of(FaultValue value) {
  switch (value) {
    case FaultValue::length:
      return {Dimension::length};
    case FaultValue::angle:
      return {Dimension::angle, Dimension::length};
    case FaultValue::rate:
      return {Dimension::angular_speed, Dimension::speed};
    case FaultValue::time:
      return {Dimension::time};
    case FaultValue::none:
    case FaultValue::share:
    case FaultValue::number:
      break;
  }
  return {Dimension::number};
}

/// Each once, in the order of the list.
std::vector<std::string> once(std::string FaultKind::*member) {
  std::vector<std::string> words;
  for (const FaultKind& kind : fault_kinds()) {
    if (std::find(words.begin(), words.end(), kind.*member) == words.end()) {
      words.push_back(kind.*member);
    }
  }
  return words;
}

std::vector<std::string> devices_that_fail() { return once(&FaultKind::device); }
std::vector<std::string> fault_names() { return once(&FaultKind::name); }

const FaultKind& read_fault(Config& config, const std::string& device, const std::string& fault) {
  std::size_t index = 0;
  const std::string unknown = unknown_fault(device, fault, index);
  if (!unknown.empty()) throw config.error("fault", unknown);
  return fault_kinds()[index];
}

Read read_inject(Config& config) {
  Inject inject;
  inject.device = config.text("device");
  inject.fault = config.text("fault");
  const FaultKind& kind = read_fault(config, inject.device, inject.fault);
  if (config.has("value")) {
    const std::string value = config.text("value");
    const std::vector<Dimension> allowed = dimensions_of(kind.value);
    const auto dimension = dimension_of(value);
    if (!dimension || std::find(allowed.begin(), allowed.end(), *dimension) == allowed.end()) {
      throw config.error("value", "found '" + value + "', expected " + describe(allowed.front()));
    }
    inject.value = parse_quantity(value, *dimension);
  }
  if (const std::string wrong = wrong_fault_value(kind, inject.value); !wrong.empty()) {
    throw config.error("value", wrong);
  }
  config.optional("for", Dimension::time, inject.duration, at_least(0));
  config.optional("after", Dimension::time, inject.after, at_least(0));
  return {inject, 15};
}

Read read_clear_injections(Config& config) {
  ClearInjections clear;
  clear.device = config.text("device");
  config.optional("fault", clear.fault);
  if (!clear.fault.empty()) read_fault(config, clear.device, clear.fault);
  return {clear, 15};
}

Read read_clear_all(Config& step) {
  expect_nothing(step, "clear_injections");
  return {ClearInjections{}, 15};
}

}  // namespace

Lights read_lamps(Config& config, Lights lights) {
  read_lamp(config, "sun", lights.sun);
  read_lamp(config, "albedo", lights.albedo);
  config.optional("azimuth", Dimension::angle, lights.sun_azimuth);
  config.optional("elevation", Dimension::angle, lights.sun_elevation);
  return lights;
}

std::vector<VerbInfo> cell_verbs() {
  return {
      {"lights",
       "sets the lamps; done when the facility reports them so",
       "20 s",
       {{"sun", Kind::number, false, "0 %", "sun lamp"},
        {"albedo", Kind::number, false, "0 %", "albedo lamp"},
        {"azimuth", Kind::angle, false, "0 deg", "of the sun lamp, cell frame"},
        {"elevation", Kind::angle, false, "0 deg", "of the sun lamp, cell frame"}},
       read_lights},
      {"inject",
       "injects a fault into the simulated cell; an error on a real cell",
       "15 s",
       {{"device", Kind::words, true, "", "arm-replica, arm-sensor, lidar, plc or target",
         devices_that_fail()},
        {"fault", Kind::words, true, "", "of the device's list", fault_names()},
        {"value", Kind::quantity, false, "0", "its size"},
        {"for", Kind::time, false, "until cleared", "after which it clears itself"},
        {"after", Kind::time, false, "at once", "in the midst of the steps that follow"}},
       read_inject},
      {"clear_injections",
       "ends injected faults, all of them when nothing stands behind it",
       "15 s",
       {{"device", Kind::words, true, "", "as injected", devices_that_fail()},
        {"fault", Kind::words, false, "all of the device", "as injected", fault_names()}},
       read_clear_injections,
       std::nullopt,
       read_clear_all},
  };
}

}  // namespace berth::procedures
