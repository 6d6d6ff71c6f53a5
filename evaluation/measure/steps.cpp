// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "evaluation/measure/series.h"

namespace berth::evaluation {
namespace {

/// Estimate and truth at the end of one stretch of a phase and of the next.
struct Step {
  const ComparedEstimate& from;
  const ComparedEstimate& to;

  Vector6d estimated() const { return difference(from.estimate.pose, to.estimate.pose); }
  Vector6d error() const { return estimated() - difference(from.truth.pose, to.truth.pose); }
  /// As if truth's errors at both ends were independent. Those of a calibration are nearly the same
  /// at both and drop out, so that this is rather too much.
  Matrix6d truth_covariance() const { return from.truth.covariance + to.truth.covariance; }
};

const ComparedEstimate* last_in(const Phase::Stretch& stretch, const Measurer& measurer) {
  const ComparedEstimate* last = nullptr;
  for (const ComparedEstimate& c : measurer.compared()) {
    if (c.estimate.utime >= stretch.start && c.estimate.utime <= stretch.end) last = &c;
  }
  return last;
}

using OfStep = Uncertain (*)(const Step&);

/// One sample for every two neighbouring stretches that both hold a good estimate.
Series step_series(OfStep value, const Measurer& measurer, const Phase& phase) {
  Series series;
  const ComparedEstimate* before = nullptr;
  for (const Phase::Stretch& stretch : phase.stretches) {
    const ComparedEstimate* last = last_in(stretch, measurer);
    if (before != nullptr && last != nullptr) {
      const Uncertain v = value({*before, *last});
      series.utime.push_back(last->estimate.utime);
      series.value.push_back(v.value);
      series.truth_sigma.push_back(v.truth_sigma);
    }
    before = last;
  }
  if (series.value.empty()) series.reason = "no two neighbouring stretches with a good estimate";
  return series;
}

template <int axis>
Uncertain estimated(const Step& step) {
  return {step.estimated()(axis), 0};
}

Uncertain position_error(const Step& step) {
  return length_of(step.error().head<3>(), step.truth_covariance().topLeftCorner<3, 3>());
}

Uncertain attitude_error(const Step& step) {
  return length_of(step.error().tail<3>(), step.truth_covariance().bottomRightCorner<3, 3>());
}

}  // namespace

void add_steps(std::vector<Measurement>& table) {
  using enum Direction;
  Family family("steps: the pose's change from one stretch of a phase to the next", table);
  const auto length = berth::Dimension::length;
  const auto angle = berth::Dimension::angle;
  const auto add = [&family](const char* name, berth::Dimension dimension, Direction direction,
                             OfStep value, const char* description) {
    family.series(
        name, dimension, direction,
        [value](const Measurer& m, const Phase& p) { return step_series(value, m, p); },
        description);
  };
  add("position_step_error", length, smaller_is_better, position_error,
      "length of the estimated change of position minus the true one");
  add("attitude_step_error", angle, smaller_is_better, attitude_error,
      "length of the estimated change of attitude minus the true one");
  family.detail();
  add("x_step", length, neither, estimated<0>,
      "estimated change of x, between each stretch's last estimates");
  family.detail();
  add("y_step", length, neither, estimated<1>, "of y");
  family.detail();
  add("z_step", length, neither, estimated<2>, "of z");
  family.detail();
  add("attitude_x_step", angle, neither, estimated<3>, "estimated change of attitude about x");
  family.detail();
  add("attitude_y_step", angle, neither, estimated<4>, "about y");
  family.detail();
  add("attitude_z_step", angle, neither, estimated<5>, "about z");
}

}  // namespace berth::evaluation
