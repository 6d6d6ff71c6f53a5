// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/testbed_state_t.hpp>
#include <optional>
#include <string>

#include "procedures/engine/actions.h"

namespace berth::procedures {

/// Commands of one kind to the testbed: one motion at a time, and the lease beside it.
class TestbedLink {
 public:
  TestbedLink(Actions& actions, Commander commander);

  /// Starts a motion; fills in all but what it requests.
  void command(testbed_command2_t command, Utime now);
  CommandStatus status() const { return motion_.status(); }
  /// Why the motion was refused, or given up; a sentence.
  const std::string& refusal() const { return refusal_; }

  /// HOLD, RESUME, STOP or RESET: goes beside the motion, whose answer is still awaited.
  void order(std::int8_t what, Utime now);
  bool order_pending() const { return order_.pending(); }

  /// Of the motion under way and of all later ones, 0..1.
  void set_override(double override, Utime now);
  double override() const { return override_; }

  /// Requests the lease and keeps it until release_lease.
  void take_lease(Utime now);
  void release_lease(Utime now);
  bool has_lease() const { return wants_lease_ && holds_lease_; }
  /// It was ours and somebody else took it, or the testbed dropped it.
  bool lost_lease() const { return wants_lease_ && held_once_ && !holds_lease_; }

  void on(const testbed_state_t& state);
  /// Neither moving nor held in a motion.
  bool at_rest() const;
  /// Repeats what has not been acknowledged; keeps the lease.
  void tick(Utime now);
  const std::optional<testbed_state_t>& state() const { return state_; }

 private:
  /// Of the lease: whether it was obeyed is seen in the state.
  void send_lease(std::int8_t what, Utime now);
  void keep_lease(Utime now);

  Actions& actions_;
  Commander commander_;
  CommandClient<testbed_command2_t> motion_;
  CommandClient<testbed_command2_t> order_;
  std::string refusal_;
  double override_ = 1;
  bool wants_lease_ = false;
  bool holds_lease_ = false;
  bool held_once_ = false;
  Utime lease_sent_ = 0;
  std::optional<testbed_state_t> state_;
};

}  // namespace berth::procedures
