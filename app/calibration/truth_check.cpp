// SPDX-License-Identifier: BSD-3-Clause
#include "app/calibration/truth_check.h"

#include <algorithm>
#include <vector>

#include "common/core/error.h"
#include "evaluation/run/truth_track.h"
#include "lcmtypes/channels.h"
#include "logs/file/log_reader.h"

namespace berth {
namespace {

constexpr double slow = 0.05;  // m/s: faster, and the clocks matter more than the cell

evaluation::TruthTrack track_of(const std::filesystem::path& file, const char* channel,
                                std::string* basis) {
  evaluation::TruthTrack track;
  logs::LogReader reader(file);
  logs::LogEvent event;
  while (reader.next(event)) {
    if (event.channel != channel) continue;
    const auto truth = logs::decode<ground_truth_t>(event.data);
    if (!truth) continue;
    track.add(evaluation::sample_of(*truth));
    if (basis != nullptr) *basis = truth->basis;
  }
  if (track.samples().empty()) {
    throw InputError(file.string() + ": holds no " + channel);
  }
  return track;
}

double quantile(std::vector<double>& values, double q) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Sums for the slope of an error's component along the motion against the speed, about its mean.
struct Slope {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  void add(double speed, double error) {
    n += 1;
    x += speed;
    y += error;
    xx += speed * speed;
    xy += speed * error;
  }
  double covariance() const { return xy - x * y / n; }
  double variance() const { return xx - x * x / n; }
};

}  // namespace

TruthCheck check_truth(const std::filesystem::path& run) {
  TruthCheck check;
  const auto truth = track_of(run / "run.lcm", channels::ground_truth, &check.basis);
  const auto world = track_of(run / "world_truth.lcm", channels::world_truth, nullptr);
  std::vector<double> position;
  std::vector<double> rotation;
  Slope slopes[3];
  for (const evaluation::TruthSample& sample : truth.samples()) {
    const auto at = world.at(sample.utime);
    if (!at) continue;
    const Vector3d error = sample.pose.position - at->pose.position;
    for (int i = 0; i < 3; ++i) slopes[i].add(at->velocity.linear[i], error[i]);
    if (at->velocity.linear.norm() > slow) continue;
    position.push_back(error.norm());
    rotation.push_back(angle_between(sample.pose, at->pose));
  }
  if (position.empty()) throw InputError(run.string() + ": truth and world do not overlap");
  check.samples = static_cast<std::int64_t>(position.size());
  check.median_position = quantile(position, 0.5);
  check.worst_position = quantile(position, 0.95);
  check.median_rotation = quantile(rotation, 0.5);
  check.worst_rotation = quantile(rotation, 0.95);
  double covariance = 0;
  double variance = 0;
  for (const Slope& slope : slopes) {
    covariance += slope.covariance();
    variance += slope.variance();
  }
  check.time = variance > 0 ? covariance / variance : 0;
  return check;
}

}  // namespace berth
