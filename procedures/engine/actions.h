// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/estimator_command_t.hpp>
#include <berth/facility_command_t.hpp>
#include <berth/injection_t.hpp>
#include <berth/testbed_command_t.hpp>
#include <string>

#include "common/bus/loop.h"

namespace berth::procedures {

/// What the engine does to the world.
class Actions {
 public:
  virtual ~Actions() = default;
  virtual void send(const testbed_command_t& command) = 0;
  virtual void send(const estimator_command_t& command) = 0;
  virtual void send(const facility_command_t& command) = 0;
  virtual void send(const injection_t& injection) = 0;
  virtual void event(std::int8_t severity, const std::string& code, const std::string& text) = 0;
};

/// Where a command is on its way.
enum class Answer { none, pending, accepted, refused, finished };

/// Who commands, and in which run.
struct Commander {
  std::string name;
  std::int64_t session = 0;
  /// Commands are numbered above this: above all that this commander sent before in the session.
  std::int64_t last_seq = 0;
};

/// How often a command is repeated until it is acknowledged, and for how long one is good.
inline constexpr Utime repeat_period = 500 * millisecond;
inline constexpr Utime command_lifetime = 2 * second;
/// One that stops must not cost the arms' way of half a second.
inline constexpr Utime stop_repeat_period = 100 * millisecond;
/// A lease lasts for two seconds, and must not be lost with a fifth of the messages: ten in a row,
/// once in ten million.
inline constexpr Utime lease_period = 200 * millisecond;

}  // namespace berth::procedures
