// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/estimator_command_t.hpp>
#include <berth/estimator_state_t.hpp>
#include <berth/facility_command_t.hpp>
#include <berth/facility_state_t.hpp>
#include <berth/testbed_command_t.hpp>
#include <berth/testbed_state_t.hpp>
#include <optional>
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
  virtual void event(std::int8_t severity, const std::string& code, const std::string& text) = 0;
};

/// Where a command is on its way.
enum class Answer { none, pending, accepted, refused, finished };

/// Who commands, and in which run.
struct Commander {
  std::string name;
  std::int64_t session = 0;
};

/// How often a command is repeated until it is acknowledged, and for how long one is good.
inline constexpr Utime repeat_period = 500 * millisecond;
inline constexpr Utime command_lifetime = 2 * second;

/// Commands of one kind to the testbed: one motion at a time, and the lease beside it.
class TestbedLink {
 public:
  TestbedLink(Actions& actions, Commander commander);

  /// Starts a motion under a new seq; fills in all but what it asks for.
  void command(testbed_command_t command, Utime now);
  Answer answer() const { return motion_.answer; }
  const std::string& refusal() const { return motion_.refusal; }

  /// HOLD, RESUME, STOP or RESET: goes beside the motion, whose answer is still awaited.
  void order(std::int8_t what, Utime now);
  Answer order_answer() const { return order_.answer; }

  /// Asks for the lease and keeps it until release_lease.
  void take_lease(Utime now);
  void release_lease(Utime now);
  bool has_lease() const { return wants_lease_ && holds_lease_; }
  /// It was ours and somebody else took it, or the testbed dropped it.
  bool lost_lease() const { return wants_lease_ && held_once_ && !holds_lease_; }

  void on(const testbed_state_t& state);
  /// Repeats what has not been acknowledged; keeps the lease.
  void tick(Utime now);
  const std::optional<testbed_state_t>& state() const { return state_; }

 private:
  struct Tracked {
    testbed_command_t command{};
    Utime sent = 0;
    Answer answer = Answer::none;
    std::string refusal;
  };

  void start(Tracked& tracked, testbed_command_t command, Utime now);
  static void look_for_answer(Tracked& tracked, const testbed_state_t& state);
  void send(testbed_command_t& command, Utime now);
  void send_lease(Utime now);

  Actions& actions_;
  Commander commander_;
  std::int64_t last_seq_ = 0;
  Tracked motion_;
  Tracked order_;
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
  Answer answer() const { return answer_; }
  const std::string& refusal() const { return refusal_; }
  std::int64_t seq() const { return command_.seq; }
  std::int64_t first_scan_id() const { return command_.first_scan_id; }

  void on(const estimator_state_t& state, Utime now);
  void tick(Utime now);
  const std::optional<estimator_state_t>& state() const { return state_; }

 private:
  void send_anew(Utime now);

  Actions& actions_;
  Commander commander_;
  std::int64_t last_seq_ = 0;
  estimator_command_t command_{};
  int attempts_ = 0;
  Utime sent_ = 0;
  Answer answer_ = Answer::none;
  std::string refusal_;
  std::optional<estimator_state_t> state_;
};

/// The lamps: what is wanted is sent until the facility reports it.
class FacilityLink {
 public:
  FacilityLink(Actions& actions, Commander commander);

  void command(facility_command_t command, Utime now);
  bool reached() const;

  void on(const facility_state_t& state);
  void tick(Utime now);
  const std::optional<facility_state_t>& state() const { return state_; }

 private:
  void send(Utime now);

  Actions& actions_;
  Commander commander_;
  facility_command_t command_{};
  bool wanted_ = false;
  Utime sent_ = 0;
  std::optional<facility_state_t> state_;
};

}  // namespace berth::procedures
