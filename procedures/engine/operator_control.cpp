// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/operator_control.h"

#include "common/core/config.h"
#include "procedures/language/verbs.h"

namespace berth::procedures {
namespace {

/// Whether the comma-separated list contains the word.
bool contains_word(const std::string& text, const std::string& word) {
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::size_t first = text.find_first_not_of(' ', begin);
    if (first < end) {
      const std::size_t last = text.find_last_not_of(' ', end - 1);
      if (text.compare(first, last + 1 - first, word) == 0) return true;
    }
    begin = end + 1;
  }
  return false;
}

}  // namespace

std::string OperatorControl::reason_to_refuse(const procedure_command_t& command, Utime now) const {
  if (!lease_.held(now) || lease_.holder() == command.commander) return {};
  switch (command.command) {
    case procedure_command_t::HOLD:
    case procedure_command_t::ABORT:
    case procedure_command_t::KEEP_CONTROL:  // changes nothing
      return {};
    case procedure_command_t::TAKE_CONTROL:
      if (contains_word(command.text, take_over_word)) return {};
      return lease_.holder() + " has control, and it can be taken over only explicitly";
    default:
      return lease_.holder() + " has control";
  }
}

std::string OperatorControl::take(const procedure_command_t& command, Utime now) {
  const std::string before = lease_.held(now) ? lease_.holder() : "";
  const bool held_before = holds_when_lost_;
  lease_.release(before, now);
  lease_.take(command.commander, now);
  holds_when_lost_ = contains_word(command.text, hold_when_lost_word);
  if (before == command.commander && holds_when_lost_ == held_before) return {};
  return command.commander +
         (before.empty() || before == command.commander
              ? " has control"
              : " has taken control over from " + before) +
         (holds_when_lost_ ? "; the procedure holds when control is lost" : "");
}

bool OperatorControl::release(const std::string& commander, Utime now) {
  holds_when_lost_ = holds_when_lost_ && !lease_.held_by(commander, now);
  return lease_.release(commander, now);
}

std::string OperatorControl::lapse(Utime now) {
  const std::string holder = lease_.holder();
  return lease_.lapse(now) ? holder : "";
}

operator_control_t OperatorControl::state(Utime now) const {
  operator_control_t state{};
  state.utime = now;
  if (!lease_.held(now)) return state;
  state.holder = lease_.holder();
  state.utime_expires = lease_.expires();
  state.holds_when_lost = holds_when_lost_ ? 1 : 0;
  return state;
}

double speed_override_of(const std::string& text) {
  constexpr double slowest = 0.01;
  const double override = parse_quantity(text, Dimension::number);
  if (override >= slowest && override <= 1) return override;
  throw InputError("found '" + text + "', expected 1 % to 100 %; to stop, hold it");
}

facility_command_t lamps_of(const std::string& text, const facility_state_t& now) {
  Config config = Config::parse("{" + text + "}", "lamps");
  if (config.keys().empty()) {
    throw InputError("found '" + text + "', expected lamps such as 'sun: 80 %, albedo: 10 %'");
  }
  const Lights lights = read_lamps(
      config, {now.sun_lamp, now.albedo_lamp, now.sun_azimuth_rad, now.sun_elevation_rad});
  config.finish();
  facility_command_t command{};
  command.sun_lamp = lights.sun;
  command.albedo_lamp = lights.albedo;
  command.sun_azimuth_rad = lights.sun_azimuth;
  command.sun_elevation_rad = lights.sun_elevation;
  return command;
}

}  // namespace berth::procedures
