// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/facility_state_t.hpp>
#include <optional>
#include <string>

#include "procedures/engine/actions.h"

namespace berth::procedures {

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
  /// What is not yet as it was requested, with both values; empty: nothing.
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
  bool matched_ = false;    // the state before
  std::optional<facility_state_t> state_;
};

}  // namespace berth::procedures
