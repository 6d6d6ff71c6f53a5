// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/facility_link.h"

#include <array>
#include <cmath>
#include <numbers>

#include "common/core/pose.h"
#include "common/core/text.h"

namespace berth::procedures {
namespace {

// What the PLC's registers show (config/registers/plc.yaml) is rounded to a step of theirs.
constexpr double rounding = 0.5001;  // of a step
constexpr double level_step = 1e-4;
constexpr double angle_step = radians(0.01);

struct Item {
  const char* name;
  double requested;
  double shown;
  bool is_angle;

  bool reached() const {
    const double off = requested - shown;
    return is_angle ? std::abs(std::remainder(off, 2 * std::numbers::pi)) <= rounding * angle_step
                    : std::abs(off) <= rounding * level_step;
  }
  std::string text() const {
    const auto in_words = [this](double value) {
      return is_angle ? fixed(degrees(value), 2) + " deg" : fixed(100 * value, 2) + " %";
    };
    return std::string(name) + " " + in_words(shown) + " of " + in_words(requested);
  }
};

std::array<Item, 4> items(const facility_command_t& requested, const facility_state_t& shown) {
  return {{{"sun lamp", requested.sun_lamp, shown.sun_lamp, false},
           {"albedo lamp", requested.albedo_lamp, shown.albedo_lamp, false},
           {"azimuth", requested.sun_azimuth_rad, shown.sun_azimuth_rad, true},
           {"elevation", requested.sun_elevation_rad, shown.sun_elevation_rad, true}}};
}

}  // namespace

FacilityLink::FacilityLink(Actions& actions, Commander commander)
    : commander_(std::move(commander)),
      client_([&actions](const facility_command_t& command) { actions.send(command); }) {}

void FacilityLink::command(facility_command_t command, Utime now) {
  overtakes_ = unreached_;
  matched_ = false;
  unreached_ = true;
  client_.send(std::move(command), commander_, now);
}

void FacilityLink::on(const facility_state_t& state) {
  state_ = state;
  if (!unreached_ || state.utime < client_.command().utime) return;
  const bool matches = missing().empty();
  // On the way to something else the lamps may pass what is requested now.
  if (matches && (matched_ || !overtakes_)) unreached_ = false;
  matched_ = matches;
}

std::string FacilityLink::missing() const {
  if (!state_) return "the facility is silent";
  if (state_->valid == 0) return "the facility does not answer: " + state_->reason;
  std::string text;
  for (const Item& item : items(client_.command(), *state_)) {
    if (!item.reached()) text += (text.empty() ? "" : ", ") + item.text();
  }
  return text;
}

}  // namespace berth::procedures
