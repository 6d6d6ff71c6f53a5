// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/truth/ground_truth.h"

#include <algorithm>
#include <cmath>

namespace berth::testbed {
namespace {

double seconds(std::int64_t microseconds) { return static_cast<double>(microseconds) * 1e-6; }

/// Joints per second between two samples.
double rate(const JointSample& from, const JointSample& to, std::size_t joint) {
  return (to.joints[joint] - from.joints[joint]) / seconds(to.utime - from.utime);
}

}  // namespace

GroundTruth::GroundTruth(const Cell& cell, const Calibration& calibration, const Settings& settings,
                         Publish publish)
    : relative_pose_(cell),
      covariance_(cell, calibration),
      settings_(settings),
      publish_(std::move(publish)) {}

std::deque<JointSample>& GroundTruth::of(ArmRole role) {
  return role == ArmRole::replica ? replica_ : sensor_;
}

void GroundTruth::add(ArmRole role, const JointSample& sample) {
  std::deque<JointSample>& samples = of(role);
  if (!samples.empty() && sample.utime <= samples.back().utime) return;
  samples.push_back(sample);
  if (replica_.empty() || sensor_.empty()) {
    // keep samples that may still be the earlier neighbour of a grid time
    while (samples.size() > 3) samples.pop_front();
    return;
  }
  const std::int64_t period = settings_.period;
  const std::int64_t first = std::max(replica_.front().utime, sensor_.front().utime);
  if (next_ < first) next_ = (first + period - 1) / period * period;
  const std::int64_t last = std::min(replica_.back().utime, sensor_.back().utime);
  for (; next_ <= last; next_ += period) {
    ArmMoment replica;
    ArmMoment sensor;
    if (interpolate_at(ArmRole::replica, next_, replica) &&
        interpolate_at(ArmRole::sensor, next_, sensor)) {
      publish(next_, replica, sensor);
    } else {
      ++skipped_;
    }
  }
  for (const ArmRole role_of_queue : both_arms) {
    std::deque<JointSample>& queue = of(role_of_queue);
    // one sample more than the interpolation needs: for the acceleration
    while (queue.size() > 2 && queue[2].utime <= next_) queue.pop_front();
  }
}

bool GroundTruth::interpolate_at(ArmRole role, std::int64_t utime, ArmMoment& result) {
  const std::deque<JointSample>& samples = of(role);
  std::size_t i = 0;
  while (i + 1 < samples.size() && samples[i + 1].utime <= utime) ++i;
  const JointSample& before = samples[i];
  if (before.utime > utime) return false;
  const bool exact = before.utime == utime;
  if (i + 1 == samples.size()) {
    if (!exact) return false;
    result = {before.joints, {}, before.sigma, before.time_sigma};
    for (std::size_t k = 0; k < 6 && i > 0; ++k) result.rate[k] = rate(samples[i - 1], before, k);
    return true;
  }
  const JointSample& after = samples[i + 1];
  if (!exact && after.utime - before.utime > settings_.largest_gap) return false;
  const double gap = seconds(after.utime - before.utime);
  const double s = seconds(utime - before.utime) / gap;
  for (std::size_t k = 0; k < 6; ++k) {
    result.joints[k] = before.joints[k] + s * (after.joints[k] - before.joints[k]);
    result.rate[k] = rate(before, after, k);
    double bow = 0;
    if (i > 0) {
      const JointSample& earlier = samples[i - 1];
      const double acceleration = (result.rate[k] - rate(earlier, before, k)) /
                                  (0.5 * seconds(after.utime - earlier.utime));
      bow = 0.5 * acceleration * s * (1 - s) * gap * gap;
    }
    result.sigma[k] = std::hypot(std::max(before.sigma[k], after.sigma[k]), bow);
  }
  result.time_sigma = std::max(before.time_sigma, after.time_sigma);
  return true;
}

void GroundTruth::publish(std::int64_t utime, const ArmMoment& replica, const ArmMoment& sensor) {
  Truth truth;
  truth.utime = utime;
  truth.pose = relative_pose_.at(replica.joints, sensor.joints);
  while (!recent_.empty() && utime - recent_.front().utime > settings_.velocity_window) {
    recent_.pop_front();
  }
  if (!recent_.empty()) {
    truth.velocity =
        velocity_between(recent_.front().pose, truth.pose, seconds(utime - recent_.front().utime));
  }
  truth.covariance = covariance_.at(replica, sensor);
  recent_.push_back(truth);
  publish_(truth);
}

}  // namespace berth::testbed
