// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/estimator_command_t.hpp>
#include <berth/estimator_state_t.hpp>
#include <berth/facility_command_t.hpp>
#include <berth/facility_state_t.hpp>
#include <berth/injection_state_t.hpp>
#include <berth/injection_t.hpp>
#include <berth/testbed_command2_t.hpp>
#include <berth/testbed_state_t.hpp>
#include <berth/verdict_basis_t.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/commands.h"

namespace berth::procedures {

/// The engine's publications.
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

/// Commands of one kind to the testbed: one motion at a time, and the lease.
class TestbedLink {
 public:
  TestbedLink(Actions& actions, Commander commander);

  /// Starts a motion; fills in commander, number and times.
  void command(testbed_command2_t command, Utime now);
  CommandStatus status() const { return motion_.status(); }
  /// Why the motion was refused, or given up; a sentence.
  const std::string& refusal() const { return refusal_; }

  /// HOLD, RESUME, STOP or RESET: sent while the answer to the motion is still awaited.
  void order(std::int8_t what, Utime now);
  bool order_pending() const { return order_.pending(); }

  /// Of the motion under way and of all later ones, 0..1.
  void set_override(double override, Utime now);
  double override() const { return override_; }

  /// Requests the lease and keeps it until release_lease.
  void take_lease(Utime now);
  void release_lease(Utime now);
  bool has_lease() const { return wants_lease_ && holds_lease_; }
  /// The lease was ours; another commander has taken it, or the testbed dropped it.
  bool lost_lease() const { return wants_lease_ && held_once_ && !holds_lease_; }

  void on(const testbed_state_t& state);
  /// Neither moving nor held in a motion.
  bool at_rest() const;
  /// Repeats unacknowledged commands; keeps the lease.
  void tick(Utime now);
  const std::optional<testbed_state_t>& state() const { return state_; }

 private:
  /// Sends a lease command, which the testbed's state acknowledges.
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

/// Commands to the estimator. One that came too late for its first scan is sent anew.
class EstimatorLink {
 public:
  EstimatorLink(Actions& actions, Commander commander);

  void command(estimator_command_t command, Utime now);
  CommandStatus status() const { return client_.status(); }
  const std::string& refusal() const { return client_.reason(); }
  std::int64_t seq() const { return client_.command().seq; }
  std::int64_t first_scan_id() const { return client_.command().first_scan_id; }

  void on(const estimator_state_t& state, Utime now);
  void tick(Utime now) { client_.tick(now); }
  const std::optional<estimator_state_t>& state() const { return state_; }

 private:
  /// For the first scan that it can still change.
  void send(estimator_command_t command, Utime now);

  Commander commander_;
  CommandClient<estimator_command_t> client_;
  int attempts_ = 0;
  std::optional<estimator_state_t> state_;
};

/// The lamps: the request is sent until the facility driver answers; then its state shows
/// when they are as requested, level and direction.
class FacilityLink {
 public:
  FacilityLink(Actions& actions, Commander commander);

  void command(facility_command_t command, Utime now);
  bool pending() const { return client_.pending(); }
  CommandStatus status() const { return client_.status(); }
  const std::string& refusal() const { return client_.reason(); }
  /// The lamps are as requested.
  bool reached() const { return status() == CommandStatus::accepted && !unreached_; }
  /// The values that differ from the request, with both; empty: none.
  std::string missing() const;

  void on(const facility_state_t& state);
  void on(const command_answers_t& answers) { client_.on(answers); }
  void tick(Utime now) { client_.tick(now); }
  const std::optional<facility_state_t>& state() const { return state_; }

 private:
  Commander commander_;
  CommandClient<facility_command_t> client_;
  bool unreached_ = false;
  bool overtakes_ = false;  // the lamps may still be on the way to what was requested before
  bool matched_ = false;    // at the previous state
  std::optional<facility_state_t> state_;
};

/// Commands of faults to the simulated cell. A real cell never answers.
class InjectionLink {
 public:
  InjectionLink(Actions& actions, Commander commander);

  /// Fills in commander, number and times.
  void command(injection_t injection, Utime now);
  /// The same at a later time, independent of the engine's state then; clearing the fault cancels
  /// it.
  void command_later(injection_t injection, Utime due);
  /// accepted, refused or still pending.
  CommandStatus status() const { return client_.status(); }
  const std::string& refusal() const { return client_.reason(); }
  /// Whether anything was ever injected.
  bool used() const { return used_; }
  /// INJECTION_STATE; nothing without a simulated cell.
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
