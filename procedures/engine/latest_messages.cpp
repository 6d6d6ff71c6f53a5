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
  error_.on(message);
}

std::optional<evaluation::TruthSample> LatestMessages::truth() const {
  const auto& samples = error_.truth().samples();
  if (samples.empty() || now_ - samples.back().utime > lifetime) return std::nullopt;
  return samples.back();
}

std::optional<Vector6d> LatestMessages::error() const {
  const auto& latest = error_.latest();
  if (!latest || now_ - latest->estimate.utime > lifetime) return std::nullopt;
  return latest->error;
}

std::optional<double> LatestMessages::surface_range() const {
  const auto truth = this->truth();
  if (!truth || !nearest_) return std::nullopt;
  const Vector3d sensor = truth->pose.inverse().position;
  return (nearest_(sensor) - sensor).norm();
}

}  // namespace berth::procedures
