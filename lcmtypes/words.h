// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <berth/criterion_result_t.hpp>
#include <berth/event_t.hpp>
#include <berth/node_status_t.hpp>
#include <berth/pose_estimate_t.hpp>
#include <berth/procedure_state_t.hpp>
#include <berth/procedure_step_t.hpp>
#include <cstdint>

/// Names of the messages' enumerators, as in the definitions; "?" for an undefined value.
namespace berth::words {

template <std::size_t size>
constexpr const char* word(const std::array<const char*, size>& words, std::int8_t value) {
  return value >= 0 && static_cast<std::size_t>(value) < size
             ? words[static_cast<std::size_t>(value)]
             : "?";
}

constexpr const char* of_estimate_status(std::int8_t status) {
  return word<5>({"IDLE", "ACQUIRING", "OK", "AMBIGUOUS", "LOST"}, status);
}
constexpr const char* of_severity(std::int8_t severity) {
  return word<5>({"INFO", "NOTICE", "WARNING", "ERROR", "FATAL"}, severity);
}
constexpr const char* of_node_state(std::int8_t state) {
  return word<6>({"STARTING", "READY", "RUNNING", "DEGRADED", "FAULT", "STOPPED"}, state);
}
constexpr const char* of_step_state(std::int8_t state) {
  return word<8>(
      {"PENDING", "RUNNING", "PASSED", "FAILED", "ERROR", "TIMEOUT", "ABORTED", "SKIPPED"}, state);
}
constexpr const char* of_criterion(std::int8_t result) {
  return word<4>({"PENDING", "PASS", "FAIL", "INCONCLUSIVE"}, result);
}
/// Of none: "NONE".
constexpr const char* of_outcome(std::int8_t outcome) {
  return outcome < 0 || outcome > procedure_state_t::TIMEOUT
             ? "NONE"
             : word<6>({"PASS", "FAIL", "ERROR", "ABORTED", "INCONCLUSIVE", "TIMEOUT"}, outcome);
}

}  // namespace berth::words
