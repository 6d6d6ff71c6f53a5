// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/facility_state_t.hpp>
#include <optional>
#include <string>

#include "procedures/engine/actions.h"

namespace berth::procedures {

/// The lamps: what is asked for is sent until the facility reports it, level and direction.
class FacilityLink {
 public:
  FacilityLink(Actions& actions, Commander commander);

  void command(facility_command_t command, Utime now);
  bool reached() const;
  /// What is not yet as it was asked for, with both values; empty: nothing.
  std::string missing() const;

  void on(const facility_state_t& state);
  void tick(Utime now);
  const std::optional<facility_state_t>& state() const { return state_; }

 private:
  void send(Utime now);

  Actions& actions_;
  Commander commander_;
  facility_command_t command_{};
  bool wanted_ = false;
  bool overtakes_ = false;  // the lamps may still be on the way to what was asked for before
  bool matched_ = false;    // the state before
  Utime sent_ = 0;
  std::optional<facility_state_t> state_;
};

}  // namespace berth::procedures
