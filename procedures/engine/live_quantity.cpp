// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/live_quantity.h"

#include <algorithm>
#include <cmath>

#include "common/core/nan.h"
#include "common/core/text.h"
#include "lcmtypes/conversions.h"
#include "lcmtypes/good_estimate.h"

namespace berth::procedures {

void RunMessages::begin_phase(Utime now) {
  phase_start_ = now;
  good_estimates_ = 0;
}

void RunMessages::on(const pose_estimate_t& message, Utime now) {
  estimate = message;
  if (!is_good(message)) return;
  last_good_ = now;
  ++good_estimates_;
  error_.on(message);
}

std::optional<evaluation::TruthSample> RunMessages::truth() const {
  const auto& samples = error_.truth().samples();
  if (samples.empty() || now_ - samples.back().utime > lifetime) return std::nullopt;
  return samples.back();
}

std::optional<Vector6d> RunMessages::error() const {
  const auto& latest = error_.latest();
  if (!latest || now_ - latest->estimate.utime > lifetime) return std::nullopt;
  return latest->error;
}

std::optional<double> RunMessages::surface_range() const {
  const auto truth = this->truth();
  if (!truth || !nearest_) return std::nullopt;
  const Vector3d sensor = truth->pose.inverse().position;
  return (nearest_(sensor) - sensor).norm();
}

namespace {

constexpr double deg = radians(1.0);
constexpr double mm = 1e-3;

double age(const RunMessages& live, Utime since) {
  return since == 0 ? nan : seconds(live.now() - since);
}

bool estimated(const RunMessages& live) { return live.estimate && is_good(*live.estimate); }

double length_of(const double* vector) { return Vector3d::Map(vector).norm(); }

double position_sigma(const RunMessages& live) {
  if (!estimated(live)) return nan;
  return std::sqrt(covariance_of(live.estimate->covariance).topLeftCorner<3, 3>().trace());
}

double estimate_age(const RunMessages& live) {
  // Before the first good estimate: since the run began.
  return age(live, live.last_good_estimate() != 0 ? live.last_good_estimate() : live.run_start());
}

std::vector<LiveQuantity> make_quantities() {
  using D = Dimension;
  return {
      {"estimate",
       D::number,
       "",
       1,
       "the estimator's status for the newest scan",
       [](const RunMessages& l) { return l.estimate ? double(l.estimate->status) : nan; },
       {"idle", "acquiring", "ok", "ambiguous", "lost"}},
      {"estimate_age", D::time, "s", 1, "time since a good estimate came", estimate_age},
      {"good_estimates", D::number, "", 1, "good estimates since the phase began",
       [](const RunMessages& l) { return double(l.good_estimates()); }},
      {"estimated_range", D::length, "m", 1, "estimated distance to the model's origin",
       [](const RunMessages& l) { return estimated(l) ? length_of(l.estimate->position_m) : nan; }},
      {"estimated_speed", D::speed, "mm/s", mm, "estimated speed of the target",
       [](const RunMessages& l) {
         return estimated(l) ? length_of(l.estimate->linear_velocity_m_s) : nan;
       }},
      {"estimated_turn_rate", D::angular_speed, "deg/s", deg, "estimated turn rate of the target",
       [](const RunMessages& l) {
         return estimated(l) ? length_of(l.estimate->angular_velocity_rad_s) : nan;
       }},
      {"position_sigma", D::length, "mm", mm, "the estimator's own uncertainty of the position",
       position_sigma},
      {"position_error", D::length, "mm", mm, "distance between estimated and true position",
       [](const RunMessages& l) { return l.error() ? l.error()->head<3>().norm() : nan; }},
      {"attitude_error", D::angle, "deg", deg, "angle between estimated and true attitude",
       [](const RunMessages& l) { return l.error() ? l.error()->tail<3>().norm() : nan; }},
      {"true_range", D::length, "m", 1, "true distance to the model's origin",
       [](const RunMessages& l) { return l.truth() ? l.truth()->pose.position.norm() : nan; }},
      {"surface_range", D::length, "m", 1,
       "true distance from the sensor to the nearest surface of the target",
       [](const RunMessages& l) { return l.surface_range().value_or(nan); }},
      {"relative_speed", D::speed, "mm/s", mm, "true speed of target against sensor",
       [](const RunMessages& l) { return l.truth() ? l.truth()->velocity.linear.norm() : nan; }},
      {"relative_turn_rate", D::angular_speed, "deg/s", deg,
       "true turn rate of target against sensor",
       [](const RunMessages& l) { return l.truth() ? l.truth()->velocity.angular.norm() : nan; }},
      {"testbed",
       D::number,
       "",
       1,
       "what the testbed does",
       [](const RunMessages& l) { return l.testbed ? double(l.testbed->state) : nan; },
       {"not_ready", "idle", "moving", "closed_loop", "holding", "held", "fault"}},
      {"clearance", D::length, "m", 1, "least distance between the bodies of the cell",
       [](const RunMessages& l) {
         return l.testbed && l.testbed->clearance_m >= 0 ? l.testbed->clearance_m : nan;
       }},
      {"sun_lamp", D::number, "%", 1e-2, "sun lamp as the facility reports it",
       [](const RunMessages& l) { return l.facility ? l.facility->sun_lamp : nan; }},
      {"albedo_lamp", D::number, "%", 1e-2, "albedo lamp as the facility reports it",
       [](const RunMessages& l) { return l.facility ? l.facility->albedo_lamp : nan; }},
      {"lidar",
       D::number,
       "",
       1,
       "what the LIDAR does",
       [](const RunMessages& l) { return l.lidar ? double(l.lidar->state) : nan; },
       {"offline", "idle", "scanning", "fault"}},
      {"time_in_run", D::time, "s", 1, "time since the first step began",
       [](const RunMessages& l) { return age(l, l.run_start()); }},
      {"time_in_phase", D::time, "s", 1, "time since the phase began",
       [](const RunMessages& l) { return age(l, l.phase_start()); }},
      {"time_in_step", D::time, "s", 1, "time since the step began",
       [](const RunMessages& l) { return age(l, l.step_start()); }},
  };
}

int decimals_of(const std::string& unit) {
  if (unit == "m" || unit == "deg") return 3;
  return unit.empty() ? 0 : 1;
}

}  // namespace

std::string LiveQuantity::text(double si) const {
  if (std::isnan(si)) return "not known";
  if (is_state()) {
    const auto index = static_cast<std::size_t>(si);
    return index < words.size() ? words[index] : "?";
  }
  return fixed(si / unit_si, decimals_of(unit)) + (unit.empty() ? "" : " " + unit);
}

const std::vector<LiveQuantity>& live_quantities() {
  static const std::vector<LiveQuantity> quantities = make_quantities();
  return quantities;
}

const LiveQuantity* live_quantity_named(const std::string& name) {
  const auto& all = live_quantities();
  const auto found = std::find_if(all.begin(), all.end(),
                                  [&name](const LiveQuantity& q) { return q.name == name; });
  return found == all.end() ? nullptr : &*found;
}

std::string unknown_live_quantity(const std::string& name) {
  std::string names;
  for (const LiveQuantity& q : live_quantities()) names += (names.empty() ? "" : ", ") + q.name;
  return "found '" + name + "', expected one of: " + names;
}

}  // namespace berth::procedures
