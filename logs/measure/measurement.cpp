// SPDX-License-Identifier: BSD-3-Clause
#include "logs/measure/measurement.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "common/core/error.h"
#include "common/core/target.h"

namespace berth::logs {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

struct Value {
  double value;
  double truth_sigma;
};

double sigma_along(const Matrix3d& covariance, const Vector3d& direction) {
  const double length = direction.norm();
  // No error, no direction: the worst axis cannot be worse than all three together.
  if (length == 0) return std::sqrt(covariance.trace());
  return std::sqrt(std::max(0.0, direction.dot(covariance * direction))) / length;
}

Matrix3d position_covariance(const ComparedEstimate& c) {
  return c.truth.covariance.topLeftCorner<3, 3>();
}
Matrix3d attitude_covariance(const ComparedEstimate& c) {
  return c.truth.covariance.bottomRightCorner<3, 3>();
}

Value position_error(const ComparedEstimate& c) {
  const Vector3d e = c.error.head<3>();
  return {e.norm(), sigma_along(position_covariance(c), e)};
}

Value attitude_error(const ComparedEstimate& c) {
  const Vector3d e = c.error.tail<3>();
  return {e.norm(), sigma_along(attitude_covariance(c), e)};
}

template <int axis>
Value axis_error(const ComparedEstimate& c) {
  return {c.error(axis), std::sqrt(std::max(0.0, c.truth.covariance(axis, axis)))};
}

Value range_error(const ComparedEstimate& c) {
  const Vector3d& truth = c.truth.pose.position;
  return {c.estimate.pose.position.norm() - truth.norm(),
          sigma_along(position_covariance(c), truth)};
}

Value bearing_error(const ComparedEstimate& c) {
  const Vector3d& truth = c.truth.pose.position;
  const Vector3d& estimate = c.estimate.pose.position;
  const Vector3d across = truth.cross(estimate);
  const Matrix3d covariance = position_covariance(c);
  const double along = sigma_along(covariance, truth);
  const double sideways = std::sqrt(std::max(0.0, covariance.trace() - along * along));
  return {std::atan2(across.norm(), truth.dot(estimate)), sideways / truth.norm()};
}

Value measured_position_error(const ComparedEstimate& c) {
  const Vector3d e = c.estimate.measured.position - c.truth.pose.position;
  return {e.norm(), sigma_along(position_covariance(c), e)};
}

Value measured_attitude_error(const ComparedEstimate& c) {
  const Vector3d e = difference(c.truth.pose, c.estimate.measured).tail<3>();
  return {e.norm(), sigma_along(attitude_covariance(c), e)};
}

Value velocity_error(const ComparedEstimate& c) {
  return {(c.estimate.velocity.linear - c.truth.velocity.linear).norm(), 0};
}

Value angular_velocity_error(const ComparedEstimate& c) {
  return {(c.estimate.velocity.angular - c.truth.velocity.angular).norm(), 0};
}

/// Normalised estimation error squared, against the estimate's and truth's covariance together: 6
/// on average for a consistent estimator. NaN when they are not positive definite.
Value nees(const ComparedEstimate& c) {
  const Matrix6d sum = c.estimate.covariance + c.truth.covariance;
  const Eigen::LLT<Matrix6d> factor(sum);
  if (!sum.allFinite() || factor.info() != Eigen::Success) return {nan, 0};
  return {factor.matrixL().solve(c.error).squaredNorm(), 0};
}

using OfEstimate = Value (*)(const ComparedEstimate&);

Series estimate_series(OfEstimate value, const Measurer& measurer, const Phase& phase) {
  Series series;
  for (const ComparedEstimate& c : measurer.compared()) {
    if (!phase.contains(c.estimate.utime)) continue;
    const Value v = value(c);
    if (!std::isfinite(v.value)) continue;
    series.utime.push_back(c.estimate.utime);
    series.value.push_back(v.value);
    series.truth_sigma.push_back(v.truth_sigma);
  }
  series.without_truth = static_cast<std::size_t>(
      std::count_if(measurer.without_truth().begin(), measurer.without_truth().end(),
                    [&phase](Utime utime) { return phase.contains(utime); }));
  return series;
}

/// Distance from the sensor's origin to the nearest point of the target, where it truly was.
Value surface_range(const TruthSample& truth, const NearestPoint& nearest) {
  const Vector3d lever = truth.pose.rotation * nearest(truth.pose.inverse().position);
  const Vector3d point = lever + truth.pose.position;
  const double range = point.norm();
  if (range == 0) return {0, 0};
  Vector6d gradient;
  gradient << point / range, lever.cross(point / range);
  return {range, std::sqrt(std::max(0.0, gradient.dot(truth.covariance * gradient)))};
}

/// Of truth itself, ten times a second and at the end of each stretch.
template <class Function>
Series truth_series(Function value, const Measurer& measurer, const Phase& phase) {
  constexpr Utime period = 100 * millisecond;
  Series series;
  const auto& samples = measurer.record().truth().samples();
  for (const Phase::Stretch& stretch : phase.stretches) {
    auto sample = std::lower_bound(samples.begin(), samples.end(), stretch.start,
                                   [](const TruthSample& s, Utime t) { return s.utime < t; });
    Utime next = stretch.start;
    for (; sample != samples.end() && sample->utime <= stretch.end; ++sample) {
      const auto after = std::next(sample);
      const bool last = after == samples.end() || after->utime > stretch.end;
      if (sample->utime < next && !last) continue;
      next = sample->utime + period;
      const Value v = value(*sample);
      series.utime.push_back(sample->utime);
      series.value.push_back(v.value);
      series.truth_sigma.push_back(v.truth_sigma);
    }
  }
  return series;
}

Series surface_range_series(const Measurer& measurer, const Phase& phase) {
  if (!measurer.nearest()) return {};
  return truth_series(
      [&measurer](const TruthSample& truth) { return surface_range(truth, measurer.nearest()); },
      measurer, phase);
}

/// The docking interface of a run's target, model frame; nothing when it has none or is not at
/// hand.
std::optional<Vector3d> docking_interface(const RunRecord& record) {
  if (!record.info()) return std::nullopt;
  try {
    const Target target = load_target(record.info()->target, record.info()->target_length_m);
    if (target.has_docking_interface) return target.docking.position;
  } catch (const InputError&) {
  }
  return std::nullopt;
}

/// Of where the docking interface truly was in the sensor frame: its distance from the sensor's
/// origin along the axes that count.
Series docking_series(const Measurer& measurer, const Phase& phase, const Vector3d& axes) {
  const auto docking = docking_interface(measurer.record());
  if (!docking) return {};
  return truth_series(
      [&](const TruthSample& truth) {
        const Vector3d lever = truth.pose.rotation * *docking;
        const Vector3d place = (truth.pose.position + lever).cwiseProduct(axes);
        const double length = place.norm();
        if (length == 0) return Value{0, 0};
        Vector6d gradient;
        gradient << place / length, lever.cross(place / length);
        return Value{length, std::sqrt(std::max(0.0, gradient.dot(truth.covariance * gradient)))};
      },
      measurer, phase);
}

Series docking_offset_series(const Measurer& measurer, const Phase& phase) {
  return docking_series(measurer, phase, Vector3d(1, 1, 0));
}

Series docking_range_series(const Measurer& measurer, const Phase& phase) {
  return docking_series(measurer, phase, Vector3d::Ones());
}

Value relative_position_error(const ComparedEstimate& c) {
  const Value error = position_error(c);
  const double range = c.truth.pose.position.norm();
  return {error.value / range, error.truth_sigma / range};
}

Series relative_speed_series(const Measurer& measurer, const Phase& phase) {
  return truth_series(
      [](const TruthSample& truth) {
        return Value{truth.velocity.linear.norm(), 0};
      },
      measurer, phase);
}

std::vector<Utime> good_times(const Measurer& measurer, const Phase& phase) {
  std::vector<Utime> times;
  for (const EstimateSample& e : measurer.record().estimates()) {
    if (e.ok() && phase.contains(e.utime)) times.push_back(e.utime);
  }
  return times;
}

Measured update_rate(const Measurer& measurer, const Phase& phase) {
  const auto times = good_times(measurer, phase);
  const auto count = static_cast<std::int64_t>(times.size());
  if (phase.duration_s() <= 0) return {nan, 0, count, "the phase has no duration"};
  return {static_cast<double>(count) / phase.duration_s(), 0, count, ""};
}

Measured tracking_share(const Measurer& measurer, const Phase& phase) {
  const auto& estimates = measurer.record().estimates();
  if (phase.duration_s() <= 0) return {nan, 0, 0, "the phase has no duration"};
  Utime tracked = 0;
  for (auto e = estimates.begin(); e != estimates.end(); ++e) {
    if (!e->ok()) continue;
    Utime until = e->utime + Measurer::estimate_lifetime;
    if (std::next(e) != estimates.end()) until = std::min(until, std::next(e)->utime);
    for (const Phase::Stretch& stretch : phase.stretches) {
      tracked +=
          std::max<Utime>(0, std::min(until, stretch.end) - std::max(e->utime, stretch.start));
    }
  }
  return {seconds(tracked) / phase.duration_s(), 0,
          static_cast<std::int64_t>(good_times(measurer, phase).size()), ""};
}

Measured time_to_acquire(const Measurer& measurer, const Phase& phase) {
  const auto times = good_times(measurer, phase);
  if (times.empty()) return {nan, 0, 0, "no pose was found"};
  return {seconds(times.front() - phase.start()), 0, 1, ""};
}

Measured longest_gap(const Measurer& measurer, const Phase& phase) {
  const auto times = good_times(measurer, phase);
  Utime longest = 0;
  for (const Phase::Stretch& stretch : phase.stretches) {
    Utime last = stretch.start;
    for (const Utime t : times) {
      if (t < stretch.start || t > stretch.end) continue;
      longest = std::max(longest, t - last);
      last = t;
    }
    longest = std::max(longest, stretch.end - last);
  }
  return {seconds(longest), 0, static_cast<std::int64_t>(times.size()), ""};
}

Measured duration(const Measurer&, const Phase& phase) { return {phase.duration_s(), 0, 1, ""}; }

Measured estimate_count(const Measurer& measurer, const Phase& phase) {
  const auto count = static_cast<std::int64_t>(good_times(measurer, phase).size());
  return {static_cast<double>(count), 0, count, ""};
}

Measurement of_estimates(const char* name, Dimension dimension, const char* unit, double si,
                         OfEstimate value, const char* description) {
  return {name,
          dimension,
          unit,
          si,
          description,
          [value](const Measurer& m, const Phase& p) { return estimate_series(value, m, p); },
          nullptr};
}

std::vector<Measurement> make_measurements() {
  constexpr double mm = 1e-3;
  constexpr double deg = radians(1.0);
  const auto length = [](const char* name, OfEstimate value, const char* description) {
    return of_estimates(name, Dimension::length, "mm", mm, value, description);
  };
  const auto angle = [](const char* name, OfEstimate value, const char* description) {
    return of_estimates(name, Dimension::angle, "deg", deg, value, description);
  };
  return {
      length("position_error", position_error, "distance between estimated and true position"),
      of_estimates("relative_position_error", Dimension::number, "%", 1e-2, relative_position_error,
                   "position error over the true range"),
      length("x_error", axis_error<0>, "estimated minus true x (right)"),
      length("y_error", axis_error<1>, "estimated minus true y (down)"),
      length("z_error", axis_error<2>, "estimated minus true z (along the boresight)"),
      angle("attitude_error", attitude_error, "angle between estimated and true attitude"),
      angle("attitude_x_error", axis_error<3>, "attitude error about x"),
      angle("attitude_y_error", axis_error<4>, "attitude error about y"),
      angle("attitude_z_error", axis_error<5>, "attitude error about z"),
      length("range_error", range_error, "estimated minus true distance of the model's origin"),
      angle("bearing_error", bearing_error, "angle between estimated and true direction"),
      length("measured_position_error", measured_position_error,
             "position error of single scans, before the filter"),
      angle("measured_attitude_error", measured_attitude_error,
            "attitude error of single scans, before the filter"),
      of_estimates("velocity_error", Dimension::speed, "mm/s", mm, velocity_error,
                   "estimated against true linear velocity"),
      of_estimates("angular_velocity_error", Dimension::angular_speed, "deg/s", deg,
                   angular_velocity_error, "estimated against true angular velocity"),
      of_estimates("nees", Dimension::number, "", 1, nees,
                   "error squared over its covariance; 6 on average when consistent"),
      {"surface_range", Dimension::length, "mm", mm,
       "true distance from the sensor to the nearest surface of the target", surface_range_series,
       nullptr},
      {"docking_range", Dimension::length, "mm", mm,
       "true distance from the sensor to the docking interface", docking_range_series, nullptr},
      {"docking_offset", Dimension::length, "mm", mm,
       "true distance of the docking interface from the boresight", docking_offset_series, nullptr},
      {"relative_speed", Dimension::speed, "mm/s", mm, "true speed of target against sensor",
       relative_speed_series, nullptr},
      {"update_rate", Dimension::frequency, "Hz", 1, "good estimates per second", nullptr,
       update_rate},
      {"tracking_share", Dimension::number, "%", 1e-2,
       "share of time with a good estimate not older than 2 s", nullptr, tracking_share},
      {"time_to_acquire", Dimension::time, "s", 1,
       "from the start of the phase to the time of its first good estimate", nullptr,
       time_to_acquire},
      {"longest_gap", Dimension::time, "s", 1, "longest time without a good estimate", nullptr,
       longest_gap},
      {"duration", Dimension::time, "s", 1, "how long the phase lasted", nullptr, duration},
      {"estimates", Dimension::number, "", 1, "number of good estimates", nullptr, estimate_count},
  };
}

}  // namespace

const std::vector<Measurement>& measurements() {
  static const std::vector<Measurement> table = make_measurements();
  return table;
}

const Measurement* measurement_named(const std::string& name) {
  for (const Measurement& measurement : measurements()) {
    if (measurement.name == name) return &measurement;
  }
  return nullptr;
}

Measurer::Measurer(const RunRecord& record, NearestPoint nearest)
    : record_(record), nearest_(std::move(nearest)) {
  for (const EstimateSample& estimate : record.estimates()) {
    if (!estimate.ok()) continue;
    if (const auto truth = record.truth().at(estimate.utime)) {
      compared_.push_back({estimate, *truth, difference(truth->pose, estimate.pose)});
    } else {
      without_truth_.push_back(estimate.utime);
    }
  }
}

Measured Measurer::measure(const Measurement& what, Statistic statistic, const Phase& phase) const {
  if (what.number) return what.number(*this, phase);
  const Series series = what.series(*this, phase);
  const auto samples = static_cast<std::int64_t>(series.value.size());
  if (samples == 0) {
    if (what.name == "surface_range" && !nearest_) {
      return {nan, 0, 0, "the target's surface is not at hand"};
    }
    return {nan, 0, 0,
            series.without_truth == 0
                ? "no samples"
                : "no truth for any of " + std::to_string(series.without_truth) + " estimates"};
  }
  // Truth's errors are mostly those of calibration and do not average out.
  return {compute(statistic, series.value), compute(Statistic::rms, series.truth_sigma), samples,
          ""};
}

}  // namespace berth::logs
