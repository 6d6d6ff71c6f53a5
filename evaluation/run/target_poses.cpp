// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/run/target_poses.h"

#include <algorithm>
#include <berth/ground_truth_t.hpp>
#include <berth/pose_estimate_t.hpp>
#include <cstdlib>

#include "evaluation/run/run_record.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/good_estimate.h"
#include "logs/file/log_reader.h"

namespace berth::evaluation {

TargetPoses::TargetPoses(const std::filesystem::path& log, PoseSource source) {
  const bool by_truth = source == PoseSource::truth;
  logs::LogReader reader(log);
  logs::LogEvent event;
  while (reader.next(event)) {
    if (by_truth) {
      const auto message = logs::decode<ground_truth_t>(event, channels::ground_truth);
      if (message) truth_[message->session].add(sample_of(*message));
    } else {
      const auto message = logs::decode<pose_estimate_t>(event, channels::pose_estimate);
      if (!message || !is_good(*message)) continue;
      const EstimateSample sample = sample_of(*message);
      estimates_[{message->session, message->scan_id}].push_back(
          {sample.utime, sample.pose, sample.velocity});
    }
  }
}

std::optional<Pose> TargetPoses::at(std::int64_t session, std::int64_t scan_id, Utime utime) const {
  if (const auto track = truth_.find(session); track != truth_.end()) {
    const auto sample = track->second.at(utime);
    return sample ? std::optional(sample->pose) : std::nullopt;
  }
  const auto of_scan = estimates_.find({session, scan_id});
  if (of_scan == estimates_.end()) return std::nullopt;
  const auto nearest = std::min_element(
      of_scan->second.begin(), of_scan->second.end(), [&](const Estimate& a, const Estimate& b) {
        return std::abs(a.utime - utime) < std::abs(b.utime - utime);
      });
  return moved(nearest->pose, nearest->velocity, seconds(utime - nearest->utime));
}

}  // namespace berth::evaluation
