// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/latest_messages.h"

#include "lcmtypes/good_estimate.h"

namespace berth::procedures {

void LatestMessages::begin_phase(Utime now) {
  phase_start_ = now;
  good_estimates_ = 0;
}

void LatestMessages::on(const pose_estimate_t& message, Utime now) {
  estimate_ = message;
  if (!is_good(message)) return;
  last_good_ = now;
  ++good_estimates_;
  constexpr std::size_t max_waiting = 100;
  uncompared_.push_back(message);
  if (uncompared_.size() > max_waiting) uncompared_.pop_front();
}

void LatestMessages::on(const ground_truth_t& message) {
  truth_.add(evaluation::sample_of(message));
  const auto& samples = truth_.samples();
  const Utime newest = samples.back().utime;
  // Seldom, because what stays is moved.
  if (newest - samples.front().utime > 4 * lifetime) truth_.forget_before(newest - 2 * lifetime);
  compare(newest);
}

void LatestMessages::compare(Utime until) {
  while (!uncompared_.empty() && uncompared_.front().utime <= until) {
    const pose_estimate_t& estimate = uncompared_.front();
    if (const auto compared =
            evaluation::compare(evaluation::sample_of(estimate), truth_, symmetry_)) {
      error_ = compared->error;
      error_utime_ = estimate.utime;
    }
    uncompared_.pop_front();
  }
}

std::optional<evaluation::TruthSample> LatestMessages::truth() const {
  const auto& samples = truth_.samples();
  if (samples.empty() || now_ - samples.back().utime > lifetime) return std::nullopt;
  return samples.back();
}

std::optional<Vector6d> LatestMessages::error() const {
  return now_ - error_utime_ > lifetime ? std::nullopt : error_;
}

std::optional<double> LatestMessages::surface_range() const {
  const auto truth = this->truth();
  if (!truth || !nearest_) return std::nullopt;
  const Vector3d sensor = truth->pose.inverse().position;
  return (nearest_(sensor) - sensor).norm();
}

}  // namespace berth::procedures
