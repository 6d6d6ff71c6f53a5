// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "common/core/nan.h"
#include "evaluation/measure/series.h"

namespace berth::evaluation {
namespace {

/// Slower than this the replica stands: truth's own noise is of this size.
constexpr double still_m_s = 2e-3;
constexpr double still_rad_s = 2e-3;

/// When faults began in the phase.
std::vector<Utime> fault_times(const Measurer& measurer, const Phase& phase) {
  std::vector<Utime> times = measurer.record().fault_times();
  std::erase_if(times, [&phase](Utime utime) { return !phase.contains(utime); });
  return times;
}

/// The longest of the times from each fault to the response: a time, or 0 for never.
Measured longest(const Measurer& measurer, const Phase& phase,
                 const std::function<Utime(Utime)>& answer) {
  const auto faults = fault_times(measurer, phase);
  if (faults.empty()) return {nan, 0, 0, "nothing was injected"};
  Utime max_delay = 0;
  for (const Utime fault : faults) {
    const Utime answered = answer(fault);
    if (answered == 0) return {nan, 0, 0, "a fault was not answered"};
    max_delay = std::max(max_delay, answered - fault);
  }
  return {seconds(max_delay), 0, static_cast<std::int64_t>(faults.size()), ""};
}

Measured reaction_time(const Measurer& measurer, const Phase& phase) {
  return longest(measurer, phase, [&](Utime fault) -> Utime {
    for (const event_t& event : measurer.record().events()) {
      const bool stops = event.node == "testbed" && event.severity >= event_t::WARNING;
      if (stops && event.utime >= fault) return event.utime;
    }
    return 0;
  });
}

Measured stopping_time(const Measurer& measurer, const Phase& phase) {
  return longest(measurer, phase, [&](Utime fault) -> Utime {
    for (const TruthSample& truth : measurer.record().truth().samples()) {
      if (truth.utime >= fault && truth.velocity.linear.norm() < still_m_s &&
          truth.velocity.angular.norm() < still_rad_s) {
        return truth.utime;
      }
    }
    return 0;
  });
}

}  // namespace

void add_safety(std::vector<Measurement>& table) {
  using enum Direction;
  Family family(safety_family, table);
  family.number(
      "reaction_time", berth::Dimension::time, smaller_is_better, reaction_time,
      "longest time from an injected fault to the testbed's event with which it stops the arms");
  family.in_milliseconds();
  family.number("stopping_time", berth::Dimension::time, smaller_is_better, stopping_time,
                "longest time from an injected fault until truth shows the replica at rest");
  family.in_milliseconds();
}

}  // namespace berth::evaluation
