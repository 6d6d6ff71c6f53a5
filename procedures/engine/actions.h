// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/estimator_command_t.hpp>
#include <berth/facility_command_t.hpp>
#include <berth/injection_t.hpp>
#include <berth/testbed_command2_t.hpp>
#include <berth/verdict_basis_t.hpp>
#include <string>

#include "common/bus/command_client.h"

namespace berth::procedures {

/// What the engine does to the world.
class Actions {
 public:
  virtual ~Actions() = default;
  virtual void send(const testbed_command2_t& command) = 0;
  virtual void send(const estimator_command_t& command) = 0;
  virtual void send(const facility_command_t& command) = 0;
  virtual void send(const injection_t& injection) = 0;
  virtual void send(const verdict_basis_t& basis) = 0;
  virtual void event(std::int8_t severity, const std::string& code, const std::string& text) = 0;
};

}  // namespace berth::procedures
