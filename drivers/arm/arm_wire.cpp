// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/arm/arm_wire.h"

#include <cmath>

namespace berth {

double pendant_from_si(double value, bool linear) { return linear ? 1000 * value : degrees(value); }

double si_from_pendant(double value, bool linear) { return linear ? value / 1000 : radians(value); }

std::array<bool, 6> linear_axes(const ArmKinematics& kinematics) {
  std::array<bool, 6> linear{};
  for (std::size_t i = 0; i < 6; ++i) linear[i] = kinematics.is_linear(static_cast<int>(i));
  return linear;
}

ArmReport ArmWire::decode(std::span<const Word> words, int& tick_ms) const {
  const auto at = [&](int address) { return words.data() + (address - map_.status.first); };
  const auto number = [&](const RegisterField& field) { return field.get(at(field.address)); };
  const auto whole = [&](const RegisterField& field) {
    return static_cast<int>(std::lround(number(field)));
  };
  ArmReport report;
  report.valid = *at(map_.position + position_words::joints_valid - 1) == 1;
  for (std::size_t i = 0; i < 6; ++i) {
    const int address = map_.position + position_words::joints - 1 + 2 * static_cast<int>(i);
    const double value = static_cast<double>(get_float(at(address)));
    report.joints[i] = si_from_pendant(value, linear_[i]);
    if (!std::isfinite(value)) report.valid = false;
  }
  // Of another tool than the flange the controller reports a point that is not the flange.
  const auto element = [&](int word) { return at(map_.position + word - 1); };
  if (*element(position_words::cartesian_valid) == 1 && *element(position_words::tool) == 0) {
    Vector3d flange;
    for (int i = 0; i < 3; ++i) {
      flange[i] = double{get_float(element(position_words::cartesian + 2 * i))} / 1000;
    }
    report.flange = flange;
  }
  tick_ms = whole(map_.tick);
  report.heartbeat = whole(map_.heartbeat);
  report.setpoint_taken = whole(map_.setpoint_taken);
  report.state = whole(map_.state);
  report.error = whole(map_.error);
  report.program_state = *at(map_.program_state);
  report.speed_override = number(map_.speed_override) / 100;
  report.tcp_speed = number(map_.tcp_speed) / 1000;
  return report;
}

std::span<const Word> ArmWire::encode(const ArmOrder& order, int host_heartbeat) {
  block_.assign(static_cast<std::size_t>(map_.command.count), 0);
  const auto at = [&](int address) { return block_.data() + (address - map_.command.first); };
  for (std::size_t i = 0; i < 6; ++i) {
    put_float(static_cast<float>(pendant_from_si(order.joints[i], linear_[i])),
              at(map_.setpoint_joints + 2 * static_cast<int>(i)));
  }
  *at(map_.setpoint_valid) = 1;
  const auto put = [&](const RegisterField& field, double value) {
    field.put(value, at(field.address));
  };
  put(map_.setpoint_sequence, order.sequence);
  put(map_.command_word, order.follow ? 1 : 0);
  put(map_.host_heartbeat, host_heartbeat);
  put(map_.speed_limit, 100 * order.speed_limit);
  put(map_.setpoint_time, static_cast<double>(order.time / millisecond % map_.counter_wrap));
  put(map_.mode, 1);
  return block_;
}

}  // namespace berth
