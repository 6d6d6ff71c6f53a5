// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/injection_state_t.hpp>
#include <optional>
#include <string>
#include <vector>

#include "procedures/engine/actions.h"

namespace berth::procedures {

/// Faults requested of the simulated cell. A real cell never answers.
class InjectionLink {
 public:
  InjectionLink(Actions& actions, Commander commander);

  /// Fills in all but what it requests.
  void command(injection_t injection, Utime now);
  /// The same when it is due, whatever the engine does then; clearing it takes it back.
  void command_later(injection_t injection, Utime due);
  /// accepted, refused or still pending.
  CommandStatus status() const { return client_.status(); }
  const std::string& refusal() const { return client_.reason(); }
  /// Whether anything was ever injected.
  bool used() const { return used_; }
  /// The simulated cell's own words; nothing where there is none.
  const std::optional<injection_state_t>& state() const { return state_; }

  void on(const injection_state_t& state);
  void tick(Utime now);

 private:
  struct Later {
    injection_t injection;
    Utime due;
  };

  Commander commander_;
  CommandClient<injection_t> client_;
  bool used_ = false;
  std::vector<Later> later_;
  std::optional<injection_state_t> state_;
};

}  // namespace berth::procedures
