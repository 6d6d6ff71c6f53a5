// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/facility_command_t.hpp>
#include <berth/facility_state_t.hpp>
#include <berth/operator_control_t.hpp>
#include <berth/procedure_command_t.hpp>
#include <string>

#include "common/bus/loop.h"
#include "common/core/lease.h"

namespace berth::procedures {

/// How long control lasts without being kept.
inline constexpr Utime control_lifetime = 1500 * millisecond;

/// Words of a TAKE_CONTROL's text, separated by commas.
inline constexpr char take_over_word[] = "take over";  ///< from its present holder
inline constexpr char hold_when_lost_word[] = "hold";  ///< when the holder is lost

/// The operator who controls a procedure: at most one, who must renew it. Without a holder every
/// operator may command.
class OperatorControl {
 public:
  /// Why a command is refused; empty: it is not. HOLD and ABORT are obeyed from any sender.
  std::string reason_to_refuse(const procedure_command_t& command, Utime now) const;

  /// @return the change as text; empty: none. @pre reason_to_refuse() is empty
  std::string take(const procedure_command_t& command, Utime now);
  bool keep(const std::string& commander, Utime now) { return lease_.keep(commander, now); }
  bool release(const std::string& commander, Utime now);
  /// Name of a holder that has not renewed control in time; reported once. Empty: none.
  std::string lapse(Utime now);

  bool holds_when_lost() const { return holds_when_lost_; }
  /// Without seq and session.
  operator_control_t state(Utime now) const;

 private:
  Lease lease_{control_lifetime};
  bool holds_when_lost_ = false;
};

/// A speed override, "60 %", as 0..1. @throws InputError.
double speed_override_of(const std::string& text);

/// A request to the lamps, as in a lights step: "sun: 80 %, albedo: 10 %". Values not named stay
/// unchanged. @throws InputError.
facility_command_t lamps_of(const std::string& text, const facility_state_t& now);

}  // namespace berth::procedures
