// SPDX-License-Identifier: BSD-3-Clause
#include "app/calibration/truth_check.h"

#include <vector>

#include "common/core/error.h"
#include "common/core/statistics.h"
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

}  // namespace

TruthCheck check_truth(const std::filesystem::path& run) {
  TruthCheck check;
  const auto truth = track_of(run / "run.lcm", channels::ground_truth, &check.basis);
  const auto world = track_of(run / "world_truth.lcm", channels::world_truth, nullptr);
  std::vector<double> position;
  std::vector<double> rotation;
  std::vector<double> speeds[3];
  std::vector<double> errors[3];
  for (const evaluation::TruthSample& sample : truth.samples()) {
    const auto at = world.at(sample.utime);
    if (!at) continue;
    const Vector6d error = difference(at->pose, sample.pose);
    for (int i = 0; i < 3; ++i) {
      speeds[i].push_back(at->velocity.linear[i]);
      errors[i].push_back(error[i]);
    }
    if (at->velocity.linear.norm() > slow) continue;
    position.push_back(error.head<3>().norm());
    rotation.push_back(error.tail<3>().norm());
  }
  if (position.empty()) throw InputError(run.string() + ": truth and world do not overlap");
  check.samples = static_cast<std::int64_t>(position.size());
  check.median_position = median(position);
  check.worst_position = quantile(position, 0.95);
  check.median_rotation = median(rotation);
  check.worst_rotation = quantile(rotation, 0.95);
  // Slope of the error along the motion against the speed, of the three axes together.
  double along = 0;
  double spread = 0;
  for (int i = 0; i < 3; ++i) {
    along += covariance(speeds[i], errors[i]);
    spread += covariance(speeds[i], speeds[i]);
  }
  check.time = spread > 0 ? along / spread : 0;
  return check;
}

}  // namespace berth
