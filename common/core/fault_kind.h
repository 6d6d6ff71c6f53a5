// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace berth {

/// Quantity of a fault's value.
enum class FaultValue {
  none,   ///< it is there or not
  share,  ///< 0..1
  number,
  length,  ///< m
  angle,   ///< rad or m, per joint
  rate,    ///< rad/s or m/s, per joint
  time     ///< s
};

/// A fault that can be injected into a simulated cell. Procedures and the simulated devices share
/// this list.
struct FaultKind {
  std::string device;
  std::string name;
  FaultValue value = FaultValue::none;
  double min = 0;
  double max = 0;
};

/// All of them; those of a device are adjacent. docs/simulated_cell.md describes each.
const std::vector<FaultKind>& fault_kinds();

/// @param index of the kind, when it is known.
/// @return why there is no such fault, with the known names; empty: there is.
std::string unknown_fault(const std::string& device, const std::string& name, std::size_t& index);

/// @return why a fault cannot have this value, SI; empty: it can.
std::string wrong_fault_value(const FaultKind& kind, double value);

/// " 50 mm": the value with its unit, with a blank before it; empty when it has none.
std::string text_of(FaultValue value, double size);

}  // namespace berth
